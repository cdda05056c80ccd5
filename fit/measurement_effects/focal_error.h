#pragma once

#include <memory>

#include "fit/measurement_effects/measurement_effect.h"
#include "model/cloth/effect.h"

/// The focal length is not the calibrated one: a pixel at u appears at u + excess (u - c), c the
/// camera's principal point. Parameter: excess (1), neutral at 0. Of cameras only, of all alike.
/// Ours.
namespace clothfit::focal_error {

EffectDescription describe();
std::unique_ptr<MeasurementEffect> make();

}  // namespace clothfit::focal_error
