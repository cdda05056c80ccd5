#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

namespace clothfit {

/// The least cost, half a sum of squares of whitened residuals, with one parameter held.
struct ProfilePoint {
  bool usable = false;  ///< false: no residuals, or the other parameters did not converge
  double value = 0;     ///< of the parameter held
  double cost = 0;
  Eigen::VectorXd others;  ///< where the least is, as a start for neighbours; any length
};

/// Minimises over the other parameters with this one held at `value`. `start` is the `others` of
/// the nearest point that is known.
using ProfiledCost = std::function<ProfilePoint(double value, const Eigen::VectorXd& start)>;

struct ProfileOptions {
  double level = 0.9;           ///< of the interval, above 0 and below 1
  double lower = 0, upper = 0;  ///< the parameter's range, around the optimum
  double sigma = 0;             ///< from the Hessian, > 0: how far the first step goes
  /// Variance of the whitened residuals, >= 1 where their stated sigma is too small. The cost must
  /// rise by this times half the quantile of chi-square.
  double residual_variance = 1;
  double tolerance = 1e-3;    ///< of an end, as a share of its distance
  int most_evaluations = 30;  ///< for each end

  /// Says whether they make sense around the optimum `best`.
  bool valid(double best) const;
};

enum class ProfileEnd {
  found,
  open,       ///< the cost does not rise enough up to the end of the range
  no_cost,    ///< beyond the place stated the cost could not be had; the interval goes further
  unfinished  ///< most_evaluations; the place stated is the outer end of the last bracket
};

struct ProfileInterval {
  double lower = 0, upper = 0;
  ProfileEnd lower_end = ProfileEnd::open, upper_end = ProfileEnd::open;
  /// Lower costs than the optimum's were met, so it was none. The lowest is among `points`.
  bool optimum_was_none = false;
  /// The distance of each end from the optimum over what sigma says, less 1. It is 0 where the cost
  /// is a parabola. Of an end that is not found it is a bound from below.
  double lower_excess = 0, upper_excess = 0;
  std::vector<ProfilePoint> points;  ///< all that were evaluated, in the order of their values

  /// Tells whether the symmetric interval says something else. It does where an end is not found,
  /// or lies off by more than a tenth of its distance.
  bool preferable() const;
};

/// Finds both ends of the likelihood-ratio interval [bates1988]. In it the profiled cost is below
/// the optimum's by less than residual_variance times half the quantile of chi-square with one
/// degree of freedom. On each side the end is the nearest one that the steps meet from the optimum
/// outward. A profile with several basins may go on beyond it. `best` must be
/// usable, and the options valid for it.
ProfileInterval profile_interval(const ProfilePoint& best, const ProfiledCost& cost,
                                 const ProfileOptions& options);

}  // namespace clothfit
