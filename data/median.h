#pragma once

#include <algorithm>
#include <cassert>
#include <vector>

namespace clothfit {

/// Standard deviation of a normal variable by the median of its absolute value: 1 / Phi^-1(3/4).
inline constexpr double kMadToSigma = 1.4826;

/// The median of at least one value; of an even number, the upper of the two in the middle.
inline double median(std::vector<double> values) {
  assert(!values.empty());
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace clothfit
