#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "model/cloth/cloth.h"
#include "model/fabric/fabric.h"

namespace clothfit {

/// How many springs sat on their strain limit, counted by type over frames.
struct SpringsOnLimit {
  std::array<long, kSpringTypes>
      on{};  ///< at their critical elongation, within kOnLimit, or beyond
  std::array<long, kSpringTypes> all{};  ///< springs times frames
};

/// One sweep a step leaves a spring that a later one of the sweep moved a little short of its
/// limit: it counts from this share of its critical elongation on.
inline constexpr double kOnLimit = 0.95;

/// Counts over all frames of `position_m` (3 x vertices each) but the first, which is the start. No
/// spring sits on a limit where the cloth has none.
SpringsOnLimit springs_on_limit(const Cloth& cloth, const SpringParameters& springs,
                                const std::vector<Eigen::Matrix3Xd>& position_m);

}  // namespace clothfit
