#pragma once

#include <memory>

#include "model/cloth/effect.h"

/// Makes gravity stronger or weaker than stated: F = excess m g at every vertex. Parameter: excess
/// (ratio), neutral at 0. Ours.
///
/// A clock that runs wrong looks the same: with still supports and free stiffness and damping,
/// t -> a t maps g to a^2 g.
namespace clothfit::gravity_scale {

EffectDescription describe();
std::unique_ptr<Effect> make();

}  // namespace clothfit::gravity_scale
