#pragma once

#include <memory>

#include "model/cloth/effect.h"

/// The held points creep where the cloth pulls them: with the velocity
///
///   mobility max(|F| - threshold, 0) F / |F|
///
/// F (N): what the cloth, its weight included, pulls a held point with at the beginning of the
/// step. What a point has crept is remembered. Parameters: mobility (m/(N s)), neutral at 0;
/// threshold (N), the pull up to which the point holds, which matters only where mobility does.
/// Ours: dry friction in a clamp, then viscous.
///
/// Dashpots pull on a support that creeps: mobility times a support's damping (N s/m) must stay
/// below 1, which the mobility's bounds see to for cloth.
namespace clothfit::support_slip {

EffectDescription describe();
std::unique_ptr<Effect> make();

}  // namespace clothfit::support_slip
