#pragma once

#include <memory>

#include "fit/measurement_effects/measurement_effect.h"
#include "model/cloth/effect.h"

/// Makes the camera's clock late against that of the drive. An observation of time t shows the
/// cloth at t + time. Parameter: time (s), neutral at 0. Ours.
namespace clothfit::clock_offset {

EffectDescription describe();
std::unique_ptr<MeasurementEffect> make();

}  // namespace clothfit::clock_offset
