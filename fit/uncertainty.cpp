#include "fit/uncertainty.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "fit/refine.h"

namespace clothfit {

Uncertainty estimate_uncertainty(const FitProblem& problem, const Objective& objective,
                                 const Eigen::VectorXd& values) {
  Uncertainty result;
  const ParameterSpace& space = problem.space;
  Eigen::VectorXd residual;
  Eigen::MatrixXd jacobian;
  if (!objective.linearise(values, residual, jacobian)) return result;

  const double threshold = kHuberScales * robust_scale(residual);
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(space.size(), space.size());
  double chi_square = 0;
  double weight_sum = 0;
  for (const Objective::Block& block : objective.blocks()) {
    const auto r = residual.segment(block.offset, block.dimension);
    const auto j = jacobian.middleRows(block.offset, block.dimension);
    const double weight = std::min(1.0, threshold / std::max(r.norm(), 1e-300));
    information += weight * j.transpose() * j;
    chi_square += weight * r.squaredNorm();
    weight_sum += weight * block.dimension;
  }
  result.chi_square_per_dof = chi_square / std::max(1.0, weight_sum - space.size());
  const double inflation = std::max(1.0, result.chi_square_per_dof);
  information /= inflation;

  const Eigen::VectorXd slope = space.value_by_coordinate(values);
  for (const GaussianPrior& prior : problem.priors) {
    Eigen::MatrixXd j = Eigen::MatrixXd::Zero(prior.mean.size(), space.size());
    for (size_t n = 0; n < prior.indices.size(); ++n)
      j.col(prior.indices[n]) =
          prior.sqrt_information.col(static_cast<Eigen::Index>(n)) * slope[prior.indices[n]];
    information += j.transpose() * j;
  }

  // Directions that the data say nothing about get a sigma of a million, which the caller reports
  // as undetermined, instead of spoiling the inverse for all.
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(information);
  if (eigen.info() != Eigen::Success) return result;
  constexpr double kLeastInformation = 1e-12;
  const Eigen::VectorXd variance = eigen.eigenvalues().cwiseMax(kLeastInformation).cwiseInverse();
  const Eigen::MatrixXd covariance =
      eigen.eigenvectors() * variance.asDiagonal() * eigen.eigenvectors().transpose();
  const Eigen::VectorXd sigma = covariance.diagonal().cwiseSqrt();
  result.sigma = sigma.cwiseProduct(slope);
  result.correlation =
      sigma.cwiseInverse().asDiagonal() * covariance * sigma.cwiseInverse().asDiagonal();
  result.usable = true;
  return result;
}

}  // namespace clothfit
