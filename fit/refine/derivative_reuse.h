#pragma once

#include <Eigen/Core>

namespace clothfit {

/// The fate of derivatives where a fit has moved.
enum class DerivativeReuse {
  kept,     ///< they predicted the residuals' change
  updated,  ///< they did so roughly, and were corrected by what they missed
  spent     ///< they did not
};

struct ReuseLimits {
  double kept_within = 0;     ///< what was missed, as a share of the change that was predicted
  double updated_within = 0;  ///< the same
};

/// Judges derivatives by the residuals' change along `way` in the coordinates. It updates them by
/// the smallest change that would have predicted it [broyden1965]; coordinates are weighed by what
/// they change.
DerivativeReuse reuse_derivatives(Eigen::MatrixXd& residual_by_coordinate,
                                  const Eigen::VectorXd& way, const Eigen::VectorXd& change_seen,
                                  const ReuseLimits& limits);

}  // namespace clothfit
