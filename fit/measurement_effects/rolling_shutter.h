#pragma once

#include <memory>

#include "fit/measurement_effects/measurement_effect.h"
#include "model/cloth/effect.h"

/// Makes the camera read its picture row by row. A pixel in row y of H is seen readout (y / H -
/// 1/2) later than its frame's time says, which is that of the middle row. The row is that of the
/// observed pixel, whose noise moves the time by less than a thousandth of the readout. Parameter:
/// readout (s), neutral at 0; negative where the last row is read first. It applies to cameras
/// only, to all alike. Ours.
namespace clothfit::rolling_shutter {

EffectDescription describe();
std::unique_ptr<MeasurementEffect> make();

}  // namespace clothfit::rolling_shutter
