#pragma once

namespace clothfit {

/// A time step is chosen this much shorter than the longest stable one. The estimate does not see
/// violently crumpled cloth, and stiffness and damping may grow before a new step is chosen.
inline constexpr double kStabilityMargin = 1.5;

}  // namespace clothfit
