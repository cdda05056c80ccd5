#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "model/cloth/cloth.h"
#include "model/fabric/fabric.h"

namespace clothfit {

/// Counts of springs on their strain limit, by type, over frames.
struct SpringsOnLimit {
  std::array<long, kSpringTypes>
      on{};  ///< at their critical elongation, within kOnLimit, or beyond
  std::array<long, kSpringTypes> all{};  ///< springs times frames
};

/// A spring counts from this share of its critical elongation on. In one sweep a step, a later
/// spring of the sweep moves an earlier one a little short of its limit.
inline constexpr double kOnLimit = 0.95;

/// Counts over all frames of `position_m` (3 x vertices each) but the first, which is the start. No
/// spring sits on a limit where the cloth has none.
SpringsOnLimit springs_on_limit(const Cloth& cloth, const SpringParameters& springs,
                                const std::vector<Eigen::Matrix3Xd>& position_m);

}  // namespace clothfit
