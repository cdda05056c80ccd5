#pragma once

#include <memory>

#include "fit/measurement_effects/measurement_effect.h"
#include "model/cloth/effect.h"

/// Makes the lens bend more than its calibration says: a pixel at u appears at
///
///   u + k1 r^2 (u - c),  r^2 = ((u_x - c_x) / f_x)^2 + ((u_y - c_y) / f_y)^2,
///
/// c is the principal point and f the focal lengths of the camera. Parameter: k1 (1), neutral at 0.
/// To first order it changes the k1 of [brown1971]. It applies to cameras only, to all alike. Ours.
namespace clothfit::lens_distortion {

EffectDescription describe();
std::unique_ptr<MeasurementEffect> make();

}  // namespace clothfit::lens_distortion
