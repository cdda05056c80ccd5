#pragma once

#include <algorithm>
#include <cassert>
#include <vector>

namespace clothfit {

/// Ratio of a normal variable's standard deviation to the median of its size: 1 / Phi^-1(3/4).
inline constexpr double kMadToSigma = 1.4826;

/// Returns the median of at least one value; of an even number, the upper of the two in the middle.
inline double median(std::vector<double> values) {
  assert(!values.empty());
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace clothfit
