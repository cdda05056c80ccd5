#include "fit/observe/noise.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "data/median.h"

namespace clothfit {
namespace {

/// Factor from the median absolute third difference of white normal noise to the standard deviation
/// of one value.
const double kMedianToSigma = kMadToSigma / std::sqrt(20.0);
constexpr double kBeyond = 5;
/// The median of so many is sure to a thousandth; more cost memory alone.
constexpr size_t kMostDifferences = 4'000'000;

/// Says whether the three intervals between frames f ... f + 3 are nearly equal.
bool evenly_spaced(const std::vector<double>& time_s, size_t f, double tolerance) {
  const double mean = (time_s[f + 3] - time_s[f]) / 3;
  for (size_t k = f; k < f + 3; ++k)
    if (std::abs(time_s[k + 1] - time_s[k] - mean) > tolerance * mean) return false;
  return true;
}

/// Returns the median of the first `count` of rising values.
double median_of_first(const std::vector<double>& sorted, size_t count) {
  return (sorted[(count - 1) / 2] + sorted[count / 2]) / 2;
}

/// Returns the standard deviation that the sorted absolute differences imply. Spoilt differences
/// raise the median (a fifth of them by 30 %). Those beyond `kBeyond` standard deviations are
/// therefore left out and the median taken again until nothing changes; of normal noise, next to
/// none lies there.
double robust_sigma(const std::vector<double>& sorted) {
  size_t count = sorted.size();
  while (true) {
    const double middle = median_of_first(sorted, count);
    const auto end = std::upper_bound(sorted.begin(), sorted.end(), kBeyond * kMadToSigma * middle);
    const auto within = static_cast<size_t>(end - sorted.begin());
    if (within >= count) return kMedianToSigma * middle;
    count = within;
  }
}

/// Returns first frames of four that are evenly spaced and show a track. Of those with too many
/// differences in all, it returns evenly spread ones.
std::vector<size_t> some_runs(const std::vector<double>& time_s,
                              const std::vector<Eigen::MatrixXd>& tracks,
                              const NoiseOptions& options) {
  std::vector<size_t> starts;
  size_t differences = 0;
  for (size_t f = 0; f + 3 < time_s.size(); ++f) {
    if (!evenly_spaced(time_s, f, options.interval_tolerance)) continue;
    const size_t before = differences;
    for (const Eigen::MatrixXd& track : tracks) {
      assert(track.cols() == static_cast<Eigen::Index>(time_s.size()));
      if (!track.middleCols(static_cast<Eigen::Index>(f), 4).hasNaN())
        differences += static_cast<size_t>(track.rows());
    }
    if (differences > before) starts.push_back(f);
  }
  const size_t stride =
      std::max<size_t>(1, (differences + kMostDifferences - 1) / kMostDifferences);
  std::vector<size_t> some;
  for (size_t n = 0; n < starts.size(); n += stride) some.push_back(starts[n]);
  return some;
}

}  // namespace

NoiseEstimate estimate_noise(const std::vector<double>& time_s,
                             const std::vector<Eigen::MatrixXd>& tracks,
                             const NoiseOptions& options) {
  assert(options.interval_tolerance >= 0);
  const std::vector<size_t> starts = some_runs(time_s, tracks, options);
  std::vector<double> differences;
  for (const size_t f : starts)
    for (const Eigen::MatrixXd& track : tracks) {
      const auto x = track.middleCols(static_cast<Eigen::Index>(f), 4);
      if (x.hasNaN()) continue;
      const Eigen::VectorXd d = x.col(0) - 3 * x.col(1) + 3 * x.col(2) - x.col(3);
      for (const double value : d) differences.push_back(std::abs(value));
    }

  NoiseEstimate estimate;
  estimate.differences = static_cast<int>(differences.size());
  std::sort(differences.begin(), differences.end());
  estimate.sigma =
      differences.empty() ? std::numeric_limits<double>::quiet_NaN() : robust_sigma(differences);
  return estimate;
}

}  // namespace clothfit
