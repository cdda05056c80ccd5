#include "fit/preflight/moved_markers.h"

#include <cmath>
#include <limits>
#include <utility>

#include "data/median.h"

namespace clothfit {
namespace {

/// Wilson and Hilferty's median of chi-square.
double median_of_chi_square(double degrees) {
  return degrees * std::pow(1 - 2 / (9 * degrees), 3);
}

/// Squares of what the markers of a frame moved, m2, and the sum of their variances per coordinate.
struct FrameWays {
  std::vector<double> square;
  double expected = 0, scatter = 0;  ///< of `square` by noise alone, summed

  void add(const Eigen::VectorXd& way_m, double variance) {
    const auto degrees = static_cast<double>(way_m.size());
    square.push_back(way_m.squaredNorm());
    expected += median_of_chi_square(degrees) * variance;
    scatter += std::sqrt(2 * degrees) * variance;
  }
};

}  // namespace

MovedMarkers moved_markers(const RecordedMotion& motion) {
  std::vector<FrameWays> ways(static_cast<size_t>(motion.frames()));
  for (int s = 0; s < motion.sets(); ++s) {
    const double units_per_m = motion.units_per_m(s);
    if (!(units_per_m > 0)) continue;
    const Eigen::MatrixXd first = motion.places(s, 0);
    for (const Observation& row : motion.set(s).rows) {
      const Eigen::VectorXd way =
          (row.observed.head(first.rows()) - first.col(row.marker)) / units_per_m;
      if (way.allFinite())
        ways[static_cast<size_t>(row.frame)].add(way, 2 * std::pow(row.sigma / units_per_m, 2));
    }
  }
  constexpr double kDeviations = 4;
  constexpr double kOfMedian = 1.25;  // its standard deviation, by that of a mean
  MovedMarkers moved;
  for (FrameWays& frame : ways) {
    const auto n = static_cast<double>(frame.square.size());
    if (n == 0) {
      moved.distance_m.push_back(std::numeric_limits<double>::quiet_NaN());
      moved.seen_m.push_back(std::numeric_limits<double>::quiet_NaN());
      continue;
    }
    const double square = median(std::move(frame.square)) - frame.expected / n;
    moved.distance_m.push_back(std::sqrt(std::max(0.0, square)));
    moved.seen_m.push_back(std::sqrt(kDeviations * kOfMedian * frame.scatter / std::pow(n, 1.5)));
  }
  return moved;
}

}  // namespace clothfit
