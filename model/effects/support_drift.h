#pragma once

#include <memory>

#include "model/cloth/effect.h"

/// Lets the held points drift, all alike, beside their known motion: shift(t) = velocity t, with t
/// the recording's time (s). Parameters: velocity_x, velocity_y, velocity_z (m/s), neutral at 0.
/// Ours.
namespace clothfit::support_drift {

EffectDescription describe();
std::unique_ptr<Effect> make();

}  // namespace clothfit::support_drift
