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

}  // namespace

NoiseEstimate estimate_noise(const std::vector<double>& time_s,
                             const std::vector<Eigen::MatrixXd>& tracks,
                             const NoiseOptions& options) {
  assert(options.interval_tolerance >= 0);
  size_t numbers = 0;
  for (const Eigen::MatrixXd& track : tracks) numbers += static_cast<size_t>(track.size());
  const size_t stride = 1 + numbers / kMostDifferences;
  std::vector<double> differences;
  for (size_t f = 0; f + 3 < time_s.size(); f += stride) {
    if (!evenly_spaced(time_s, f, options.interval_tolerance)) continue;
    for (const Eigen::MatrixXd& track : tracks) {
      assert(track.cols() == static_cast<Eigen::Index>(time_s.size()));
      const auto x = track.middleCols(static_cast<Eigen::Index>(f), 4);
      if (x.hasNaN()) continue;
      const Eigen::VectorXd d = x.col(0) - 3 * x.col(1) + 3 * x.col(2) - x.col(3);
      for (const double value : d) differences.push_back(std::abs(value));
    }
  }

  NoiseEstimate estimate;
  estimate.differences = static_cast<int>(differences.size());
  std::sort(differences.begin(), differences.end());
  estimate.sigma =
      differences.empty() ? std::numeric_limits<double>::quiet_NaN() : robust_sigma(differences);
  return estimate;
}

}  // namespace clothfit
