#pragma once

#include <memory>

#include "fit/measurement_effects/measurement_effect.h"
#include "model/cloth/effect.h"

/// Turns the measured world about the middle c of the placed sheet, because "down" was taken from a
/// wrong direction. A marker at x appears at c + R (x - c), R the turn about the world's axes x and
/// y by two small angles (fit/measurement_effects/rigid_change.h). Parameters: about_x, about_y
/// (rad), neutral at 0. Ours.
///
/// It is equivalent to gravity_tilt of the same angles in one case: the sheet's first pose is
/// fitted along (a cloth let go flat) and nothing but weight knows a direction. The sheet begins
/// turned by R' and falls along g, and is seen to begin unturned and to fall along R g. Elsewhere
/// the sheet and its supports are placed by what is seen, turned already; there only gravity_tilt
/// is right.
namespace clothfit::world_tilt {

EffectDescription describe();
std::unique_ptr<MeasurementEffect> make();

}  // namespace clothfit::world_tilt
