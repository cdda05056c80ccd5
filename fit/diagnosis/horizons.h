#pragma once

#include <vector>

namespace clothfit {

/// Of half chi-square per residual: a fit over a horizon that is not the last ends where a step
/// promises less.
inline constexpr double kRough = 1e-3;

/// Growing shares of the frames from `first` on, the last one all.
std::vector<double> shares_from(double first);

}  // namespace clothfit
