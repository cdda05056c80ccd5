#include "fit/problem/prior_cost.h"

namespace clothfit {

PriorCost prior_cost(const FitProblem& problem, const Eigen::VectorXd& values) {
  const Eigen::VectorXd slope = problem.space.value_by_coordinate(values);
  PriorCost result{.gradient = Eigen::VectorXd::Zero(slope.size()),
                   .information = Eigen::MatrixXd::Zero(slope.size(), slope.size())};
  for (const GaussianPrior& prior : problem.priors) {
    Eigen::MatrixXd j = Eigen::MatrixXd::Zero(prior.mean.size(), slope.size());
    for (size_t n = 0; n < prior.indices.size(); ++n)
      j.col(prior.indices[n]) =
          prior.sqrt_information.col(static_cast<Eigen::Index>(n)) * slope[prior.indices[n]];
    const Eigen::VectorXd residual = prior.residual(values);
    result.cost += 0.5 * residual.squaredNorm();
    result.gradient += j.transpose() * residual;
    result.information += j.transpose() * j;
  }
  return result;
}

}  // namespace clothfit
