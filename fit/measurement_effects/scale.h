#pragma once

#include <memory>

#include "fit/measurement_effects/measurement_effect.h"
#include "model/cloth/effect.h"

/// Measures everything larger than it is, by a factor about the middle of the placed sheet. The
/// cause may be a calibration target whose squares are not as long as stated. Parameter: factor
/// (1), neutral at 1. Ours.
namespace clothfit::scale {

EffectDescription describe();
std::unique_ptr<MeasurementEffect> make();

}  // namespace clothfit::scale
