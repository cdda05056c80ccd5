#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "fit/diagnosis/fitted_model.h"

namespace clothfit {

/// Derivatives of whitened residuals: residuals x amplitudes of each recording.
using Columns = std::vector<Eigen::MatrixXd>;

/// Derivatives of a model's residuals by the amplitudes of each law, per unit of the amplitude, at
/// their neutral values and the law's shape. Amplitudes of the measurement are each recording's
/// own: one after the other, zero in the others' residuals. Without columns for a law whose effect
/// cannot act in this model, that a predictor has no room for beside the model's own effects of the
/// measurement, or where they could not be computed.
std::vector<Columns> hypothesis_derivatives(const FittedModel& model,
                                            std::span<const Hypothesis> laws);

/// The share of a vector's square that columns explain: their squared multiple correlation, of
/// whatever both were projected to. 0 for none.
double squared_multiple_correlation(const Eigen::VectorXd& of, const Eigen::MatrixXd& columns);

}  // namespace clothfit
