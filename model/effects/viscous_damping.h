#pragma once

#include <memory>

#include "model/cloth/effect.h"

/// Damps viscously by the surrounding air: F = -rate m v at every vertex.
///
/// Source: the founding paper's F = -C v [louchet1995, section 2.2] with C = rate m, an amplitude
/// per mass, so that it survives a change of mesh. Parameter: rate (1/s), neutral at 0.
namespace clothfit::viscous_damping {

EffectDescription describe();
std::unique_ptr<Effect> make();

}  // namespace clothfit::viscous_damping
