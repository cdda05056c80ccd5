#include "fit/uncertainty/parameter_profiles.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "data/algebra/dense_factors.h"
#include "fit/cost/huber.h"
#include "fit/jobs/stop_token.h"
#include "fit/problem/box.h"
#include "fit/problem/prior_cost.h"
#include "fit/refine/least_squares.h"
#include "fit/uncertainty/cluster_covariance.h"

namespace clothfit {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// The fit's cost with everything fixed that a fit chooses on its way.
class FixedCost {
 public:
  FixedCost(const TrajectoryObjective& objective, double huber_threshold)
      : objective_(objective),
        huber_threshold_(huber_threshold),
        box_(box_of(objective.problem().space)) {}

  const TrajectoryObjective& objective() const { return objective_; }
  double huber_threshold() const { return huber_threshold_; }
  const Box& box() const { return box_; }
  Eigen::VectorXd values(const Eigen::VectorXd& coordinates) const {
    return objective_.problem().space.values(coordinates);
  }

  /// Returns the cost, which is infinite where the residuals are missing.
  double of(const Eigen::VectorXd& residual, const Eigen::VectorXd& coordinates) const {
    if (residual.size() != objective_.residual_count()) return kInfinite;
    return huber_cost(objective_, residual, huber_threshold_) +
           prior_cost(objective_.problem(), values(coordinates)).cost;
  }

  /// Returns costs of several points at once.
  std::vector<double> at(const std::vector<Eigen::VectorXd>& points) const {
    std::vector<Eigen::VectorXd> values_of;
    for (const Eigen::VectorXd& point : points) values_of.push_back(values(point));
    const std::vector<Eigen::VectorXd> residuals = objective_.residuals(values_of);
    std::vector<double> costs;
    for (size_t n = 0; n < points.size(); ++n) costs.push_back(of(residuals[n], points[n]));
    return costs;
  }

 private:
  const TrajectoryObjective& objective_;
  double huber_threshold_;
  Box box_;
};

/// The fixed cost with one coordinate held, where the others stand.
class ProfiledLeastSquares final : public LeastSquares {
 public:
  ProfiledLeastSquares(const FixedCost& fixed, const Eigen::VectorXd& x, int held)
      : fixed_(fixed), held_(held) {
    linear_ = fixed.objective().linearise(fixed.values(x));
    if (linear_.usable) stand_at(x, fixed.of(linear_.residual, x));
  }

  double cost() const override { return cost_; }
  const Eigen::VectorXd* gradient() override { return linear_.usable ? &gradient_ : nullptr; }
  void hold(std::vector<bool>& held) const override { held[static_cast<size_t>(held_)] = true; }
  Eigen::VectorXd step(double damping, const std::vector<bool>& held) override {
    Eigen::MatrixXd information = information_;
    Eigen::VectorXd right = -gradient_;
    for (Eigen::Index p = 0; p < right.size(); ++p) {
      if (!held[static_cast<size_t>(p)] && information(p, p) > 0) continue;
      information.row(p).setZero();
      information.col(p).setZero();
      information(p, p) = 1;
      right[p] = 0;
    }
    information.diagonal() *= 1 + damping;
    step_ = SymmetricFactors(information).solve(right);
    return step_;
  }
  /// The promise is the whole step's. Where the box cuts it short, the others may have far to go.
  double predicted_decrease(const Eigen::VectorXd&) const override {
    return -0.5 * gradient_.dot(step_);
  }
  bool move_to(const Eigen::VectorXd& next) override {
    Linearisation there = fixed_.objective().linearise(fixed_.values(next));
    const double cost = there.usable ? fixed_.of(there.residual, next) : kInfinite;
    if (!(cost < cost_)) return false;
    linear_ = std::move(there);
    stand_at(next, cost);
    return true;
  }
  /// Returns a thousandth of the cost's unit, which is noise; an end of an interval needs 1.35.
  double least_decrease() const override { return 1e-3; }

 private:
  void stand_at(const Eigen::VectorXd& x, double cost) {
    cost_ = cost;
    const TrajectoryObjective& objective = fixed_.objective();
    const Eigen::VectorXd weight =
        huber_weights(objective, linear_.residual, fixed_.huber_threshold());
    const PriorCost prior = prior_cost(objective.problem(), fixed_.values(x));
    const Eigen::MatrixXd weighted = weight.asDiagonal() * linear_.residual_by_coordinate;
    information_ = weighted.transpose() * linear_.residual_by_coordinate + prior.information;
    gradient_ = weighted.transpose() * linear_.residual + prior.gradient;
  }

  const FixedCost& fixed_;
  int held_;
  Linearisation linear_;
  double cost_ = kInfinite;
  Eigen::MatrixXd information_;
  Eigen::VectorXd gradient_, step_;
};

/// Minimises the cost over all coordinates but `held`, from `start`. The point's `others` are all
/// coordinates. It is not usable where the cost still decreased in the end.
ProfilePoint least_over_others(const FixedCost& fixed, const Eigen::VectorXd& start, int held) {
  constexpr int kMostSteps = 12;
  ProfiledLeastSquares problem(fixed, start, held);
  const Minimised found = minimise(problem, fixed.box(), start,
                                   {.most_iterations = kMostSteps, .most_refusals = kMostSteps});
  return {.usable = found.end == MinimiseEnd::converged,
          .value = start[held],
          .cost = problem.cost(),
          .others = found.x};
}

}  // namespace

std::vector<ParameterProfile> parameter_profiles(const TrajectoryObjective& objective,
                                                 const Eigen::VectorXd& values,
                                                 const Uncertainty& uncertainty, Loss loss,
                                                 const ProgressCallback& progress) {
  constexpr double kNoticeable = 0.2;  // of the cost: a tenth of an end's distance
  const ParameterSpace& space = objective.problem().space;
  const Eigen::VectorXd best = space.coordinates(values);
  const Eigen::VectorXd residual = objective.residuals({values}).front();
  std::vector<ParameterProfile> result;
  if (residual.size() == 0) return result;
  const FixedCost cost(objective,
                       loss == Loss::huber ? kHuberScales * robust_scale(residual) : kInfinite);
  const double cost_there = cost.of(residual, best);

  // Along this path the others are least, were the cost a parabola.
  const auto along = [&](int p, double distance) {
    const Eigen::VectorXd path =
        uncertainty.inverse_hessian.col(p) / uncertainty.inverse_hessian(p, p);
    return cost.box().clamped(best + distance * path);
  };
  std::vector<Eigen::VectorXd> points;
  for (int p = 0; p < space.size(); ++p) {
    const FitParameter& parameter = space.parameters[static_cast<size_t>(p)];
    if (!is_physical(parameter.role) || !(uncertainty.inverse_hessian(p, p) > 0)) continue;
    result.push_back({.parameter = p});
    points.push_back(along(p, -uncertainty.half_width[p]));
    points.push_back(along(p, uncertainty.half_width[p]));
  }
  const std::vector<double> costs = cost.at(points);

  const double normal = student_factor(kIntervalLevel, kInfinite);
  for (size_t n = 0; n < result.size(); ++n) {
    ParameterProfile& profile = result[n];
    const int p = profile.parameter;
    const double sigma = std::sqrt(uncertainty.inverse_hessian(p, p));
    const double variance = std::pow(uncertainty.half_width[p] / (normal * sigma), 2);
    const double parabola = 0.5 * std::pow(uncertainty.half_width[p] / sigma, 2);
    profile.rise_below = (costs[2 * n] - cost_there) / parabola;
    profile.rise_above = (costs[2 * n + 1] - cost_there) / parabola;
    if (std::abs(profile.rise_below - 1) < kNoticeable &&
        std::abs(profile.rise_above - 1) < kNoticeable)
      continue;
    report_progress(progress, {.stage = "profiles",
                               .done = static_cast<double>(n),
                               .total = static_cast<double>(result.size()),
                               .unit = "parameters",
                               .note = space.parameters[static_cast<size_t>(p)].name});
    const ProfilePoint optimum{
        .usable = true, .value = best[p], .cost = cost_there, .others = best};
    const ProfiledCost least = [&](double value, const Eigen::VectorXd& start) {
      // The start is the nearest point that is known, moved on along the path.
      Eigen::VectorXd from = start + along(p, value - best[p]) - along(p, start[p] - best[p]);
      from[p] = value;
      return least_over_others(cost, cost.box().clamped(from), p);
    };
    profile.profile = profile_interval(optimum, least,
                                       {.level = kIntervalLevel,
                                        .lower = cost.box().lower[p],
                                        .upper = cost.box().upper[p],
                                        .sigma = sigma,
                                        .residual_variance = variance,
                                        .tolerance = 0.01,
                                        .most_evaluations = 10});
    profile.profiled = true;
    const auto value_at = [&](ProfileEnd end, double place, double range_end) {
      Eigen::VectorXd at = best;
      at[p] = end == ProfileEnd::no_cost ? range_end : place;
      return space.values(at)[p];
    };
    profile.lower = value_at(profile.profile.lower_end, profile.profile.lower, cost.box().lower[p]);
    profile.upper = value_at(profile.profile.upper_end, profile.profile.upper, cost.box().upper[p]);
  }
  return result;
}

}  // namespace clothfit
