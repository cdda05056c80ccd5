#pragma once

#include <memory>

#include "model/cloth/effect.h"

/// Turns gravity away from the stated direction: F = m (R g - g). R is the turn about the
/// horizontal axes x and y of the world by two small angles.
///
/// R is the rational rotation (Cayley's) of w = (about_x, about_y, 0) / 2,
///
///   R g = g + 2 / (1 + w^2) [w x g + w x (w x g)],
///
/// which turns by 2 atan |w|: by the angles themselves up to their cube over 12. Parameters:
/// about_x, about_y (rad), neutral at 0.
namespace clothfit::gravity_tilt {

EffectDescription describe();
std::unique_ptr<Effect> make();

}  // namespace clothfit::gravity_tilt
