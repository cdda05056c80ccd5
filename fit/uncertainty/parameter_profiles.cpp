#include "fit/uncertainty/parameter_profiles.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "data/algebra/dense_factors.h"
#include "fit/cost/huber.h"
#include "fit/jobs/stop_token.h"
#include "fit/problem/prior_cost.h"
#include "fit/uncertainty/cluster_covariance.h"

namespace clothfit {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// The fit's cost with everything fixed that a fit chooses on its way.
class FixedCost {
 public:
  FixedCost(const TrajectoryObjective& objective, double huber_threshold)
      : objective_(objective), huber_threshold_(huber_threshold) {
    const ParameterSpace& space = objective.problem().space;
    lower_.resize(space.size());
    upper_.resize(space.size());
    for (int p = 0; p < space.size(); ++p) {
      lower_[p] = space.parameters[static_cast<size_t>(p)].lower;
      upper_[p] = space.parameters[static_cast<size_t>(p)].upper;
    }
    lower_ = space.coordinates(lower_);
    upper_ = space.coordinates(upper_);
  }

  const Eigen::VectorXd& lower() const { return lower_; }
  const Eigen::VectorXd& upper() const { return upper_; }

  /// Infinite where the residuals are missing.
  double of(const Eigen::VectorXd& residual, const Eigen::VectorXd& coordinates) const {
    if (residual.size() != objective_.residual_count()) return kInfinite;
    double cost = prior_cost(objective_.problem(), values(coordinates)).cost;
    for (const Objective::Block& block : objective_.blocks()) {
      const double length = residual.segment(block.offset, block.dimension).norm();
      cost += length <= huber_threshold_ ? 0.5 * length * length
                                         : huber_threshold_ * (length - 0.5 * huber_threshold_);
    }
    return cost;
  }

  /// Costs of several points at once.
  std::vector<double> at(const std::vector<Eigen::VectorXd>& points) const {
    std::vector<Eigen::VectorXd> values_of;
    for (const Eigen::VectorXd& point : points) values_of.push_back(values(point));
    const std::vector<Eigen::VectorXd> residuals = objective_.residuals(values_of);
    std::vector<double> costs;
    for (size_t n = 0; n < points.size(); ++n) costs.push_back(of(residuals[n], points[n]));
    return costs;
  }

  /// The least over all coordinates but `held`, from `start`; its `others` are all coordinates.
  ProfilePoint least(Eigen::VectorXd x, int held) const {
    constexpr int kMostSteps = 12;
    constexpr double kSmallFall = 1e-3;  // of the cost, whose unit is noise; an end needs 1.35
    ProfilePoint point{.value = x[held]};
    Linearisation here = objective_.linearise(values(x));
    if (!here.usable) return point;
    double cost = of(here.residual, x);
    double damping = 1e-6;
    for (int step = 0; step < kMostSteps; ++step) {
      const Eigen::VectorXd weight = huber_weights(objective_, here.residual, huber_threshold_);
      const PriorCost prior = prior_cost(objective_.problem(), values(x));
      const Eigen::MatrixXd weighted = weight.asDiagonal() * here.residual_by_coordinate;
      Eigen::MatrixXd information =
          weighted.transpose() * here.residual_by_coordinate + prior.information;
      Eigen::VectorXd gradient = weighted.transpose() * here.residual + prior.gradient;
      for (int p = 0; p < x.size(); ++p) {
        const bool at_bound = gradient[p] > 0 ? x[p] <= lower_[p] : x[p] >= upper_[p];
        if (p != held && !at_bound && information(p, p) > 0) continue;
        information.row(p).setZero();
        information.col(p).setZero();
        information(p, p) = 1;
        gradient[p] = 0;
      }
      information.diagonal() *= 1 + damping;
      const Eigen::VectorXd move = SymmetricFactors(information).solve(-gradient);
      if (!move.allFinite()) return point;
      point = {.usable = true, .value = x[held], .cost = cost, .others = x};
      if (-0.5 * gradient.dot(move) < kSmallFall) return point;
      const Eigen::VectorXd next = (x + move).cwiseMax(lower_).cwiseMin(upper_);
      Linearisation there = objective_.linearise(values(next));
      const double cost_there = there.usable ? of(there.residual, next) : kInfinite;
      if (!(cost_there < cost)) {
        damping = std::max(1e-3, 10 * damping);
        continue;
      }
      x = next;
      cost = cost_there;
      here = std::move(there);
      damping *= 0.1;
    }
    point.usable = false;  // still falling
    return point;
  }

 private:
  Eigen::VectorXd values(const Eigen::VectorXd& coordinates) const {
    return objective_.problem().space.values(coordinates);
  }

  const TrajectoryObjective& objective_;
  double huber_threshold_;
  Eigen::VectorXd lower_, upper_;
};

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

  // The path along which the others are least, were the cost a parabola.
  const auto along = [&](int p, double distance) {
    const Eigen::VectorXd path =
        uncertainty.inverse_hessian.col(p) / uncertainty.inverse_hessian(p, p);
    return Eigen::VectorXd((best + distance * path).cwiseMax(cost.lower()).cwiseMin(cost.upper()));
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
      // From the nearest point that is known, on along the path.
      Eigen::VectorXd from = start + along(p, value - best[p]) - along(p, start[p] - best[p]);
      from[p] = value;
      return cost.least(from.cwiseMax(cost.lower()).cwiseMin(cost.upper()), p);
    };
    profile.profile = profile_interval(optimum, least,
                                       {.level = kIntervalLevel,
                                        .lower = cost.lower()[p],
                                        .upper = cost.upper()[p],
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
    profile.lower = value_at(profile.profile.lower_end, profile.profile.lower, cost.lower()[p]);
    profile.upper = value_at(profile.profile.upper_end, profile.profile.upper, cost.upper()[p]);
  }
  return result;
}

}  // namespace clothfit
