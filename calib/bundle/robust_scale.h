#pragma once

// Private to calib/.

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "data/median.h"

namespace clothfit {

/// Estimates the standard deviation of normal errors around 0 from the median of their sizes. Up to
/// half of the errors may be gross. It is not below `floor`, so that exact data do not make
/// rounding look gross.
inline double robust_sigma(std::vector<double> errors, double floor = 1e-6) {
  if (errors.empty()) return std::numeric_limits<double>::infinity();
  for (double& error : errors) error = std::abs(error);
  return std::max(kMadToSigma * median(std::move(errors)), floor);
}

}  // namespace clothfit
