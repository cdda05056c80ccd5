#pragma once

#include <string>

namespace clothfit {

/// Returns the colour "#rrggbb" for `fraction` in [0, 1] (clamped). It is viridis, whose steps look
/// equally large to the eye, also to most colour-blind eyes and in grey print.
std::string viridis(double fraction);

/// Returns a colour for `value` in [-1, 1]: blue over white to orange, pale enough for dark text.
std::string diverging(double value);

}  // namespace clothfit
