#pragma once

// Private to calib/.

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace clothfit {

/// Standard deviation of normal errors around 0 of which up to half may be gross: 1.4826 times the
/// median of their sizes. Not below `floor`, so that exact data do not make rounding look gross.
inline double robust_sigma(std::vector<double> errors, double floor = 1e-6) {
  if (errors.empty()) return std::numeric_limits<double>::infinity();
  for (double& error : errors) error = std::abs(error);
  const auto middle = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2);
  std::nth_element(errors.begin(), middle, errors.end());
  return std::max(1.4826 * *middle, floor);
}

}  // namespace clothfit
