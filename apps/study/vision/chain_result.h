#pragma once

#include <limits>
#include <string>
#include <vector>

namespace clothfit {

/// A number at the end of the way from pictures to a fit. What it lacks is NaN.
struct ChainNumber {
  std::string name;
  std::string unit;
  double value = std::numeric_limits<double>::quiet_NaN();
  double sigma = std::numeric_limits<double>::quiet_NaN();  ///< one standard deviation
  /// Distance from the same number of other pictures, over the standard deviation of their
  /// difference.
  double over_sigma = std::numeric_limits<double>::quiet_NaN();
};

/// What the pictures of one set gave in the end.
struct ChainResult {
  std::string row;
  std::string set;
  std::vector<ChainNumber> numbers;
  std::string verdict;  ///< of the fit or the diagnosis; empty without one
  std::string reason;   ///< why nothing was measured; empty where something was
  double seconds = 0;
};

}  // namespace clothfit
