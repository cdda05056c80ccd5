#include "fit/uncertainty/uncertainty.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "data/algebra/dense_factors.h"
#include "fit/cost/huber.h"
#include "fit/problem/box.h"
#include "fit/problem/prior_cost.h"
#include "fit/uncertainty/block_bootstrap.h"
#include "fit/uncertainty/cluster_covariance.h"
#include "fit/uncertainty/observed_blocks.h"

namespace clothfit {

namespace {

constexpr double kLeastInformation = 1e-12;

/// Inverts an information matrix. Directions that the data say nothing about get a standard
/// deviation of a million instead of spoiling the inverse for all.
Eigen::MatrixXd invert(const Eigen::MatrixXd& information) {
  const SymmetricEigen eigen = symmetric_eigen(information);
  const Eigen::VectorXd variance = eigen.values.cwiseMax(kLeastInformation).cwiseInverse();
  return eigen.vectors * variance.asDiagonal() * eigen.vectors.transpose();
}

/// Adds the sandwich's variance of each coordinate and its degrees of freedom. Where there is none,
/// the variance is 0, and why is said. Returns the blocks.
Eigen::VectorXi add_robust_part(const TrajectoryObjective& objective, const LinearisedFit& fit,
                                Uncertainty& result, Eigen::VectorXd& variance) {
  variance = Eigen::VectorXd::Zero(fit.coordinates());
  result.degrees_of_freedom =
      Eigen::VectorXd::Constant(fit.coordinates(), std::numeric_limits<double>::infinity());
  const ObservedBlocks cut = observed_blocks(objective, fit.residual);
  if (cut.blocks.count < 2) {
    result.why_no_blocks = "all observations lie in one place";
    return {};
  }
  const ClusterCovariance robust = cluster_covariance(fit, cut.blocks.block);
  if (!robust.usable) {
    result.why_no_blocks = robust.reason;
    return {};
  }
  result.blocks = cut.blocks.count;
  result.block_counts = cut.counts;
  variance = robust.covariance.diagonal().cwiseMin(1 / kLeastInformation);
  result.degrees_of_freedom = robust.degrees_of_freedom;
  return cut.blocks.block;
}

/// Sets ends given in coordinates, within the ranges.
void set_ends(const ParameterSpace& space, const Eigen::VectorXd& lower_coordinates,
              const Eigen::VectorXd& upper_coordinates, Eigen::VectorXd& lower,
              Eigen::VectorXd& upper) {
  lower = space.values(lower_coordinates);
  upper = space.values(upper_coordinates);
  for (int p = 0; p < space.size(); ++p) {
    const FitParameter& parameter = space.parameters[static_cast<size_t>(p)];
    lower[p] = std::max(lower[p], parameter.lower);
    upper[p] = std::min(upper[p], parameter.upper);
  }
}

void add_bootstrap(const ParameterSpace& space, const Eigen::VectorXd& values,
                   const LinearisedFit& fit, const Eigen::VectorXi& block,
                   const UncertaintyOptions& options, Uncertainty& result) {
  const Bootstrap bootstrap =
      bootstrap_linearised(fit, block, {.replicates = options.bootstrap, .seed = options.seed});
  const ChangeIntervals change = studentised_intervals(bootstrap, kIntervalLevel);
  const Eigen::VectorXd here = space.coordinates(values);
  if (change.lower.allFinite() && change.upper.allFinite())
    set_ends(space, here + change.lower, here + change.upper, result.bootstrap_lower,
             result.bootstrap_upper);
}

/// Returns how far coordinates would move if those at an end of their range, which the gradient
/// pushes outwards, could leave it. Those ends move themselves by nothing. `bound_by` is the one
/// that moves the others most, or -1.
Eigen::VectorXd shift_by_bounds(const FitProblem& problem, const Eigen::VectorXd& values,
                                const Eigen::VectorXd& gradient, const Eigen::MatrixXd& inverse,
                                const Eigen::VectorXd& sigma, int& bound_by) {
  const ParameterSpace& space = problem.space;
  const Eigen::VectorXd here = space.coordinates(values);
  const Box box = box_of(space);
  Eigen::VectorXd shift = Eigen::VectorXd::Zero(here.size());
  std::vector<Eigen::Index> bound;
  double most = 0;
  for (Eigen::Index p = 0; p < here.size(); ++p) {
    const FitParameter& parameter = space.parameters[static_cast<size_t>(p)];
    // At its neutral value an effect does nothing, and that is the end of what is possible.
    if (parameter.role == ParameterRole::effect || !box.blocks(p, here[p], gradient[p])) continue;
    const Eigen::VectorXd moved = -gradient[p] * inverse.col(p);
    shift += moved;
    bound.push_back(p);
    for (Eigen::Index q = 0; q < here.size(); ++q) {
      if (q == p || std::abs(moved[q]) <= most * sigma[q]) continue;
      most = std::abs(moved[q]) / sigma[q];
      bound_by = static_cast<int>(p);
    }
  }
  for (const Eigen::Index p : bound) shift[p] = 0;
  return shift;
}

/// Adds intervals from standard deviations and the shift of coordinates.
void add_interval(const ParameterSpace& space, const Eigen::VectorXd& values,
                  const Eigen::VectorXd& noise, const Eigen::VectorXd& robust,
                  const Eigen::VectorXd& shift, Uncertainty& result) {
  const double normal = student_factor(kIntervalLevel, std::numeric_limits<double>::infinity());
  Eigen::VectorXd& half_width = result.half_width;
  half_width.resize(values.size());
  for (Eigen::Index p = 0; p < values.size(); ++p) {
    const double student = student_factor(kIntervalLevel, result.degrees_of_freedom[p]);
    half_width[p] = std::hypot(std::max(normal * noise[p], student * robust[p]), normal * shift[p]);
  }
  const Eigen::VectorXd here = space.coordinates(values);
  set_ends(space, here - half_width, here + half_width, result.lower, result.upper);
}

}  // namespace

Trend trend_of(const Objective& objective, const Eigen::VectorXd& values,
               const Eigen::MatrixXd& residual_by_coordinate) {
  constexpr double kWideStep = 0.01;  // to both sides, as far as ranges go
  const ParameterSpace& space = objective.problem().space;
  const Eigen::VectorXd here = space.coordinates(values);
  std::vector<int> moved;
  std::vector<Eigen::VectorXd> points;
  for (int p = 0; p < space.size(); ++p) {
    const FitParameter& parameter = space.parameters[static_cast<size_t>(p)];
    if (!is_physical(parameter.role)) continue;
    for (const double step : {kWideStep, -kWideStep}) {
      Eigen::VectorXd coordinates = here;
      coordinates[p] += step;
      points.push_back(space.values(coordinates));
      points.back()[p] = std::clamp(points.back()[p], parameter.lower, parameter.upper);
    }
    moved.push_back(p);
  }
  const std::vector<Eigen::VectorXd> residuals = objective.residuals(points);
  Trend result{.roughness = Eigen::VectorXd::Ones(space.size()),
               .residual_by_coordinate = residual_by_coordinate};
  for (size_t n = 0; n < moved.size(); ++n) {
    const Eigen::VectorXd &above = residuals[2 * n], &below = residuals[2 * n + 1];
    if (above.size() != below.size() || above.size() != residual_by_coordinate.rows()) continue;
    const double way =
        space.coordinates(points[2 * n])[moved[n]] - space.coordinates(points[2 * n + 1])[moved[n]];
    if (!(way > 0)) continue;
    const Eigen::VectorXd difference = (above - below) / way;
    auto column = result.residual_by_coordinate.col(moved[n]);
    result.roughness[moved[n]] = column.norm() / std::max(difference.norm(), 1e-300);
    if (result.roughness[moved[n]] > kRoughSlope) column = difference;
  }
  return result;
}

Uncertainty estimate_uncertainty(const TrajectoryObjective& objective,
                                 const Eigen::VectorXd& values, const UncertaintyOptions& options,
                                 Eigen::MatrixXd residual_by_coordinate) {
  Uncertainty result;
  const FitProblem& problem = objective.problem();
  LinearisedFit fit;
  if (residual_by_coordinate.rows() == objective.residual_count()) {
    fit.residual = objective.residuals({values}).front();
    fit.jacobian = std::move(residual_by_coordinate);
  } else if (Linearisation linear = objective.linearise(values); linear.usable) {
    fit.residual = std::move(linear.residual);
    fit.jacobian = std::move(linear.residual_by_coordinate);
  }
  if (fit.residual.size() != objective.residual_count()) return result;
  const TrajectoryObjective half(problem, objective.frames(), objective.steps().times(0.5));
  const Eigen::VectorXd half_step_residual = half.residuals({values}).front();
  if (half_step_residual.size() != fit.residual.size()) return result;
  result.roughness = trend_of(objective, values, fit.jacobian).roughness;

  const double threshold = options.loss == Loss::huber ? kHuberScales * robust_scale(fit.residual)
                                                       : std::numeric_limits<double>::infinity();
  fit.weight = huber_weights(objective, fit.residual, threshold);
  const Eigen::MatrixXd weighted = fit.weight.asDiagonal() * fit.jacobian;
  const Eigen::MatrixXd information = weighted.transpose() * fit.jacobian;
  const Eigen::VectorXd slope = problem.space.value_by_coordinate(values);
  const PriorCost prior = prior_cost(problem, values);
  fit.prior_information = prior.information;
  const Eigen::MatrixXd inverse = invert(information + prior.information);
  // A coordinate that its prior holds takes nothing from the residuals.
  const double fitted = information.cwiseProduct(inverse).sum();
  const double chi_square = fit.residual.cwiseAbs2().dot(fit.weight);
  result.chi_square_per_dof = chi_square / std::max(1.0, fit.weight.sum() - fitted);
  const Eigen::MatrixXd covariance =
      invert(information / std::max(1.0, result.chi_square_per_dof) + prior.information);
  const Eigen::VectorXd sigma = covariance.diagonal().cwiseSqrt();
  result.correlation =
      sigma.cwiseInverse().asDiagonal() * covariance * sigma.cwiseInverse().asDiagonal();

  result.inverse_hessian = inverse;
  const Eigen::VectorXd shift =
      -inverse * (weighted.transpose() * (2 * (half_step_residual - fit.residual)));
  const Eigen::VectorXd bound_shift =
      shift_by_bounds(problem, values, weighted.transpose() * fit.residual + prior.gradient,
                      inverse, sigma, result.bound_by);
  fit.residual -= fit.jacobian * (inverse * (weighted.transpose() * fit.residual + prior.gradient));
  Eigen::VectorXd robust_variance;
  const Eigen::VectorXi block = add_robust_part(objective, fit, result, robust_variance);
  if (options.bootstrap > 0 && block.size() > 0)
    add_bootstrap(problem.space, values, fit, block, options, result);

  result.step_shift = shift.cwiseProduct(slope);
  result.noise_sigma = sigma.cwiseProduct(slope);
  result.robust_sigma = robust_variance.cwiseSqrt().cwiseProduct(slope);
  result.bound_shift = bound_shift.cwiseProduct(slope);
  const Eigen::VectorXd both = (shift.cwiseAbs2() + bound_shift.cwiseAbs2()).cwiseSqrt();
  result.sigma = (covariance.diagonal().cwiseMax(robust_variance) + both.cwiseAbs2())
                     .cwiseSqrt()
                     .cwiseProduct(slope);
  add_interval(problem.space, values, sigma, robust_variance.cwiseSqrt(), both, result);
  result.usable = true;
  return result;
}

}  // namespace clothfit
