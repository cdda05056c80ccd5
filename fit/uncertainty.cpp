#include "fit/uncertainty.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace clothfit {

namespace {

/// Inverse of an information matrix. Directions that the data say nothing about get a standard
/// deviation of a million instead of spoiling the inverse for all.
Eigen::MatrixXd invert(const Eigen::MatrixXd& information) {
  constexpr double kLeastInformation = 1e-12;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(information);
  const Eigen::VectorXd variance = eigen.eigenvalues().cwiseMax(kLeastInformation).cwiseInverse();
  return eigen.eigenvectors() * variance.asDiagonal() * eigen.eigenvectors().transpose();
}

Eigen::MatrixXd prior_information(const FitProblem& problem, const Eigen::VectorXd& slope) {
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(slope.size(), slope.size());
  for (const GaussianPrior& prior : problem.priors) {
    Eigen::MatrixXd j = Eigen::MatrixXd::Zero(prior.mean.size(), slope.size());
    for (size_t n = 0; n < prior.indices.size(); ++n)
      j.col(prior.indices[n]) =
          prior.sqrt_information.col(static_cast<Eigen::Index>(n)) * slope[prior.indices[n]];
    information += j.transpose() * j;
  }
  return information;
}

/// See Uncertainty::roughness. Only physics makes folds.
Eigen::VectorXd roughness(const Objective& objective, const Eigen::VectorXd& values,
                          const Linearisation& linear) {
  constexpr double kWideStep = 0.02;
  const ParameterSpace& space = objective.problem().space;
  Eigen::VectorXd result = Eigen::VectorXd::Ones(space.size());
  std::vector<int> moved;
  std::vector<Eigen::VectorXd> points;
  for (int p = 0; p < space.size(); ++p) {
    if (!is_physical(space.parameters[static_cast<size_t>(p)].role)) continue;
    Eigen::VectorXd coordinates = space.coordinates(values);
    coordinates[p] += kWideStep;
    points.push_back(space.values(coordinates));
    moved.push_back(p);
  }
  const std::vector<Eigen::VectorXd> residuals = objective.residuals(points);
  for (size_t n = 0; n < moved.size(); ++n) {
    if (residuals[n].size() != linear.residual.size()) continue;
    const double wide = (residuals[n] - linear.residual).norm() / kWideStep;
    result[moved[n]] = linear.residual_by_coordinate.col(moved[n]).norm() / std::max(wide, 1e-300);
  }
  return result;
}

}  // namespace

Uncertainty estimate_uncertainty(const TrajectoryObjective& objective,
                                 const Eigen::VectorXd& values, Loss loss,
                                 const Eigen::MatrixXd& residual_by_coordinate) {
  Uncertainty result;
  const FitProblem& problem = objective.problem();
  const int parameters = problem.space.size();
  Linearisation linear;
  if (residual_by_coordinate.rows() == objective.residual_count()) {
    linear.residual = objective.residuals({values}).front();
    linear.residual_by_coordinate = residual_by_coordinate;
    linear.usable = linear.residual.size() == objective.residual_count();
  } else {
    linear = objective.linearise(values);
  }
  if (!linear.usable) return result;
  const Eigen::VectorXd& residual = linear.residual;
  const Eigen::MatrixXd& jacobian = linear.residual_by_coordinate;

  const double threshold = loss == Loss::huber ? kHuberScales * robust_scale(residual)
                                               : std::numeric_limits<double>::infinity();
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(parameters, parameters);
  std::map<std::pair<int, int>, Eigen::VectorXd> gradient_of_marker;
  const TrajectoryObjective half(problem, objective.frames(), objective.steps().times(0.5));
  const Eigen::VectorXd half_step_residual = half.residuals({values}).front();
  if (half_step_residual.size() != residual.size()) return result;
  Eigen::VectorXd step_gradient = Eigen::VectorXd::Zero(parameters);
  double chi_square = 0;
  double weight_sum = 0;
  for (const Objective::Block& block : objective.blocks()) {
    const auto r = residual.segment(block.offset, block.dimension);
    const auto j = jacobian.middleRows(block.offset, block.dimension);
    const double weight = std::min(1.0, threshold / std::max(r.norm(), 1e-300));
    information += weight * j.transpose() * j;
    auto [gradient, is_new] = gradient_of_marker.try_emplace({block.set, block.marker},
                                                             Eigen::VectorXd::Zero(parameters));
    gradient->second += weight * j.transpose() * r;
    step_gradient += weight * j.transpose() * 2 *
                     (half_step_residual.segment(block.offset, block.dimension) - r);
    chi_square += weight * r.squaredNorm();
    weight_sum += weight * block.dimension;
  }
  result.chi_square_per_dof = chi_square / std::max(1.0, weight_sum - parameters);

  const Eigen::VectorXd slope = problem.space.value_by_coordinate(values);
  const Eigen::MatrixXd prior = prior_information(problem, slope);
  const Eigen::MatrixXd covariance =
      invert(information / std::max(1.0, result.chi_square_per_dof) + prior);
  Eigen::MatrixXd scatter = Eigen::MatrixXd::Zero(parameters, parameters);
  for (const auto& [marker, gradient] : gradient_of_marker)
    scatter += gradient * gradient.transpose();
  const Eigen::MatrixXd bread = invert(information + prior);
  const Eigen::VectorXd robust_variance = (bread * scatter * bread).diagonal();

  const Eigen::VectorXd sigma = covariance.diagonal().cwiseSqrt();
  result.correlation =
      sigma.cwiseInverse().asDiagonal() * covariance * sigma.cwiseInverse().asDiagonal();
  const Eigen::VectorXd shift = -bread * step_gradient;
  result.step_shift = shift.cwiseProduct(slope);
  result.noise_sigma = sigma.cwiseProduct(slope);
  result.robust_sigma = robust_variance.cwiseSqrt().cwiseProduct(slope);
  result.sigma = (covariance.diagonal().cwiseMax(robust_variance) + shift.cwiseAbs2())
                     .cwiseSqrt()
                     .cwiseProduct(slope);

  result.roughness = roughness(objective, values, linear);
  result.usable = true;
  return result;
}

}  // namespace clothfit
