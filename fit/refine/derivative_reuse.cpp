#include "fit/refine/derivative_reuse.h"

namespace clothfit {

DerivativeReuse reuse_derivatives(Eigen::MatrixXd& residual_by_coordinate,
                                  const Eigen::VectorXd& way, const Eigen::VectorXd& change_seen,
                                  const ReuseLimits& limits) {
  const Eigen::VectorXd predicted = residual_by_coordinate * way;
  const Eigen::VectorXd missed = change_seen - predicted;
  if (missed.norm() <= limits.kept_within * predicted.norm()) return DerivativeReuse::kept;
  if (missed.norm() > limits.updated_within * predicted.norm()) return DerivativeReuse::spent;
  const Eigen::VectorXd weighed =
      residual_by_coordinate.colwise().squaredNorm().transpose().cwiseProduct(way);
  residual_by_coordinate += missed * weighed.transpose() / way.dot(weighed);
  return DerivativeReuse::updated;
}

}  // namespace clothfit
