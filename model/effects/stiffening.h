#pragma once

#include <memory>

#include "model/cloth/effect.h"

/// Bends the tension curve. With e = (l - l0) / l0 the elongation,
///
///   tension += k l0 stretched e^2 / (e + strain)      where e > 0
///   tension += k l0 compressed e^2 / (|e| + strain)   where e < 0
///
/// Under large extension a spring is 1 + stretched times as stiff (threads that have been pulled
/// straight), under large compression 1 - compressed times (threads that buckle). The stiffness
/// dT/dl is continuous, k at e = 0, and bounded by these two. The first term is k l0 (stretched /
/// strain) e^2 - ..., without the growth beyond all bounds that a step could not follow.
/// Parameters: stretched and compressed (ratios), neutral at 0; strain, the elongation about which
/// the curve bends, a shape and no amplitude. Ours.
namespace clothfit::stiffening {

EffectDescription describe();
std::unique_ptr<Effect> make();

}  // namespace clothfit::stiffening
