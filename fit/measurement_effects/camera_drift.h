#pragma once

#include <memory>

#include "fit/measurement_effects/measurement_effect.h"
#include "model/cloth/effect.h"

/// Makes the camera creep, and the measured world with it: a marker at x appears at
///
///   c + R(turn_rate (t - t0)) (x - c) + velocity (t - t0),
///
/// c is the middle of the placed sheet, R the turn by a rotation vector
/// (fit/measurement_effects/rigid_change.h), t0 the first frame's time. Parameters: velocity_x,
/// velocity_y, velocity_z (m/s), turn_rate_x, turn_rate_y, turn_rate_z (rad/s), neutral at 0.
/// Several cameras all drift as one. Ours.
namespace clothfit::camera_drift {

EffectDescription describe();
std::unique_ptr<MeasurementEffect> make();

}  // namespace clothfit::camera_drift
