#pragma once

#include <vector>

namespace clothfit {

/// Least decrease that a step must promise, of half chi-square per residual. A fit over a horizon
/// that is not the last ends where a step promises less.
inline constexpr double kUnrefinedDecrease = 1e-3;

/// Returns growing shares of the frames from `first` on, the last one all.
std::vector<double> shares_from(double first);

}  // namespace clothfit
