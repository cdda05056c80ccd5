#pragma once

#include <memory>

#include "fit/measurement_effects/measurement_effect.h"
#include "model/cloth/effect.h"

/// Makes the camera shake, and the measured world with it: a marker at x appears at
///
///   c + R(turn s) (x - c) + shift s,
///   s = sin(2 pi (frequency t + phase)) - sin(2 pi (frequency t0 + phase)),
///
/// c is the middle of the placed sheet, R the turn by a rotation vector
/// (fit/measurement_effects/rigid_change.h), t the recording's time and t0 the first frame's.
/// Parameters: shift_x, shift_y, shift_z (m), turn_x, turn_y, turn_z (rad), neutral at 0; frequency
/// (Hz) and phase (turns), which matter only where these do. Several cameras all shake as one.
/// Ours.
namespace clothfit::camera_shake {

EffectDescription describe();
std::unique_ptr<MeasurementEffect> make();

}  // namespace clothfit::camera_shake
