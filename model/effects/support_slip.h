#pragma once

#include <memory>

#include "model/cloth/effect.h"

/// Lets the held points creep where the cloth pulls them, with the velocity
///
///   mobility max(|F| - threshold, 0) F / |F|
///
/// F (N) is the cloth's pull on a held point, the weight included, at the beginning of the step.
/// The creep of a point is remembered. Parameters: mobility (m/(N s)), neutral at 0; threshold (N),
/// the pull up to which the point holds, which matters only where mobility does. Ours: dry friction
/// in a clamp, then viscous.
///
/// Dashpots pull on a support that creeps. Mobility times a support's damping (N s/m) must
/// therefore stay below 1; the mobility's bounds ensure this for cloth.
namespace clothfit::support_slip {

EffectDescription describe();
std::unique_ptr<Effect> make();

}  // namespace clothfit::support_slip
