#pragma once

#include <memory>

#include "model/cloth/effect.h"

/// Makes warp stiffer than weft beyond the fabric's own numbers, or softer:
///
///   tension += a (k (l - l0) + c dl/dt)  along the warp (types 0 and 4)
///   tension -= a (k (l - l0) + c dl/dt)  along the weft (types 1 and 5)
///
/// so that warp and weft are as (1 + a) to (1 - a); the dashpots follow their springs. Parameter: a
/// (a ratio), neutral at 0. A fabric with tension_warp and flexion_warp times 1 + a, tension_weft
/// and flexion_weft times 1 - a and the same damping times does exactly the same. Ours.
namespace clothfit::anisotropy {

EffectDescription describe();
std::unique_ptr<Effect> make();

}  // namespace clothfit::anisotropy
