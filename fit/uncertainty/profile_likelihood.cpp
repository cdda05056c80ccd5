#include "fit/uncertainty/profile_likelihood.h"

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <cassert>
#include <cmath>
#include <string>

namespace clothfit {

namespace {

/// Root of the rise. For a parabola it is a straight line, whose end a secant finds at once.
class RootOfRise {
 public:
  RootOfRise(const ProfilePoint& best, const ProfiledCost& cost, const ProfileOptions& options)
      : cost_(cost), best_(best), variance_(options.residual_variance), points_{best} {}

  struct Height {
    bool usable = false;
    double root = 0;
  };

  Height at(double value) {
    const auto nearest =
        std::min_element(points_.begin(), points_.end(), [&](const auto& a, const auto& b) {
          return std::abs(a.value - value) < std::abs(b.value - value);
        });
    ProfilePoint point = cost_(value, nearest->others);
    if (!point.usable || !std::isfinite(point.cost)) return {};
    point.value = value;
    const double rise = 2 * (point.cost - best_.cost) / variance_;
    points_.push_back(std::move(point));
    return {true, std::copysign(std::sqrt(std::abs(rise)), rise)};
  }

  std::vector<ProfilePoint> take_points() {
    std::sort(points_.begin(), points_.end(),
              [](const auto& a, const auto& b) { return a.value < b.value; });
    return std::move(points_);
  }

 private:
  const ProfiledCost& cost_;
  const ProfilePoint best_;
  double variance_;
  std::vector<ProfilePoint> points_;  // usable ones
};

struct FoundEnd {
  ProfileEnd end = ProfileEnd::unfinished;
  double distance = 0;
};

/// Finds the distance from `best` in `direction` (-1 or 1), up to `room`, at which the root reaches
/// `target`.
FoundEnd find_end(RootOfRise& rise, double best, int direction, double room, double target,
                  const ProfileOptions& options) {
  if (room <= 0) return {ProfileEnd::open, 0};
  struct Mark {
    double distance = 0, root = 0;
  };
  Mark inner;                  // below the target
  Mark outer{.distance = -1};  // above it; none yet
  double wall = room;          // no cost from here on, or the end of the range
  bool walled = false;         // no cost from the wall on
  double step = std::min(room, target * options.sigma);
  int same_side = 0;  // times in a row that one mark stayed
  bool moved_inner = false;
  for (int evaluation = 0; evaluation < options.most_evaluations; ++evaluation) {
    const RootOfRise::Height height = rise.at(best + direction * step);
    if (!height.usable) {
      walled = true;
      wall = step;
    } else if (height.root >= target) {
      same_side = moved_inner ? 0 : same_side + 1;
      moved_inner = false;
      outer = {step, height.root};
    } else {
      same_side = moved_inner ? same_side + 1 : 0;
      moved_inner = true;
      inner = {step, height.root};
      if (step >= room) return {ProfileEnd::open, room};
    }

    if (height.usable && std::abs(height.root - target) < 0.5 * options.tolerance * target)
      return {ProfileEnd::found, step * target / height.root};
    if (outer.distance < 0) {
      if (walled) {
        if (wall - inner.distance < options.tolerance * wall)
          return {ProfileEnd::no_cost, inner.distance};
        step = 0.5 * (inner.distance + wall);
        continue;
      }
      // A step outward goes as far as the slope says and a little more. It goes at least half as
      // far again, at most three times.
      const double guess = inner.root > 0 ? 1.1 * target * inner.distance / inner.root : wall;
      step = std::min(room, std::clamp(guess, 1.5 * inner.distance, 3 * inner.distance));
      continue;
    }
    const double width = outer.distance - inner.distance;
    const double slope = (outer.root - inner.root) / width;
    const double secant = inner.distance + (target - inner.root) / slope;
    if (width < options.tolerance * outer.distance) return {ProfileEnd::found, secant};
    // A mark that stays put makes the secant creep, so the bracket is halved then.
    step = same_side >= 2
               ? 0.5 * (inner.distance + outer.distance)
               : std::clamp(secant, inner.distance + 0.01 * width, outer.distance - 0.01 * width);
  }
  return {ProfileEnd::unfinished, outer.distance > 0 ? outer.distance : inner.distance};
}

}  // namespace

bool ProfileOptions::valid(double best) const {
  return level > 0 && level < 1 && lower <= best && best <= upper && lower < upper && sigma > 0 &&
         std::isfinite(sigma) && residual_variance > 0 && tolerance > 0 && most_evaluations >= 3;
}

bool ProfileInterval::preferable() const {
  constexpr double kNoticeable = 0.1;
  return lower_end != ProfileEnd::found || upper_end != ProfileEnd::found ||
         std::abs(lower_excess) > kNoticeable || std::abs(upper_excess) > kNoticeable;
}

ProfileInterval profile_interval(const ProfilePoint& best, const ProfiledCost& cost,
                                 const ProfileOptions& options) {
  assert(best.usable && std::isfinite(best.cost) && options.valid(best.value));
  const double target =
      std::sqrt(boost::math::quantile(boost::math::chi_squared(1), options.level));
  // Sigma is for a variance of 1, as the Hessian gives it.
  const double expected = target * options.sigma * std::sqrt(options.residual_variance);

  RootOfRise rise(best, cost, options);
  ProfileOptions scaled = options;
  scaled.sigma = options.sigma * std::sqrt(options.residual_variance);
  const FoundEnd below = find_end(rise, best.value, -1, best.value - options.lower, target, scaled);
  const FoundEnd above = find_end(rise, best.value, 1, options.upper - best.value, target, scaled);

  ProfileInterval result;
  result.lower = best.value - below.distance;
  result.upper = best.value + above.distance;
  result.lower_end = below.end;
  result.upper_end = above.end;
  result.lower_excess = below.distance / expected - 1;
  result.upper_excess = above.distance / expected - 1;
  result.points = rise.take_points();
  // Costs of other optimisations agree to their tolerance only.
  const double noticeable = 1e-6 * std::max(1.0, best.cost);
  for (const ProfilePoint& point : result.points)
    result.optimum_was_none = result.optimum_was_none || point.cost < best.cost - noticeable;
  return result;
}

}  // namespace clothfit
