#pragma once

#include <memory>

#include "fit/measurement_effects/measurement_effect.h"
#include "model/cloth/effect.h"

/// Makes the focal length differ from the calibrated one. A pixel at u appears at u + excess (u -
/// c), c the camera's principal point. Parameter: excess (1), neutral at 0. It applies to cameras
/// only, to all alike. Ours.
namespace clothfit::focal_error {

EffectDescription describe();
std::unique_ptr<MeasurementEffect> make();

}  // namespace clothfit::focal_error
