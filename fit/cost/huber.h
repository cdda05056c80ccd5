#pragma once

#include <Eigen/Core>

#include "fit/cost/objective.h"

namespace clothfit {

/// Huber's threshold in units of the residuals' robust scale.
inline constexpr double kHuberScales = 3;

/// Returns the size of whitened residuals: 1.4826 times the median absolute value, at least 1.
double robust_scale(const Eigen::VectorXd& residual);

/// Returns Huber's weights of residuals beyond `threshold`, by their observation's length.
Eigen::VectorXd huber_weights(const Objective& objective, const Eigen::VectorXd& residual,
                              double threshold);

/// Returns Huber's square of a residual's length: twice its cost.
inline double huber_square(double length, double threshold) {
  return length <= threshold ? length * length : threshold * (2 * length - threshold);
}

/// Returns half of Huber's sum of squares, observation by observation.
double huber_cost(const Objective& objective, const Eigen::VectorXd& residual, double threshold);

}  // namespace clothfit
