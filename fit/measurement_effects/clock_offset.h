#pragma once

#include <memory>

#include "fit/measurement_effects/measurement_effect.h"
#include "model/cloth/effect.h"

/// The clock of what looks at the cloth is late against the one of what drives it: an observation
/// of time t shows the cloth at t + time. Parameter: time (s), neutral at 0. Ours.
namespace clothfit::clock_offset {

EffectDescription describe();
std::unique_ptr<MeasurementEffect> make();

}  // namespace clothfit::clock_offset
