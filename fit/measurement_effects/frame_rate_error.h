#pragma once

#include <memory>

#include "fit/measurement_effects/measurement_effect.h"
#include "model/cloth/effect.h"

/// Makes the frame rate differ from the stated one. A frame of time t shows the cloth at t0 + (1 +
/// excess) (t - t0), t0 the first frame's time. Parameter: excess (1), neutral at 0. Ours.
///
/// With still supports, and stiffness and damping free, it is equivalent to gravity_scale. A clock
/// that is fast by 1 + e shows g, K / m and c / m as (1 + e)^2 g, (1 + e)^2 K / m and (1 + e) c /
/// m.
namespace clothfit::frame_rate_error {

EffectDescription describe();
std::unique_ptr<MeasurementEffect> make();

}  // namespace clothfit::frame_rate_error
