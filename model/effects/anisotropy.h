#pragma once

#include <memory>

#include "model/cloth/effect.h"

/// Warp stiffer than weft beyond what the fabric says, or softer:
///
///   tension += a (k (l - l0) + c dl/dt)  along the warp (types 0 and 4)
///   tension -= a (k (l - l0) + c dl/dt)  along the weft (types 1 and 5)
///
/// so that warp and weft are as (1 + a) to (1 - a); the dashpots follow their springs. Parameter: a
/// (a ratio), neutral at 0. Exactly what a fabric with tension_warp and flexion_warp times 1 + a,
/// tension_weft and flexion_weft times 1 - a and the same damping times does. Ours.
namespace clothfit::anisotropy {

EffectDescription describe();
std::unique_ptr<Effect> make();

}  // namespace clothfit::anisotropy
