#pragma once

#include <memory>

#include "fit/measurement_effects/measurement_effect.h"
#include "model/cloth/effect.h"

/// Slides the pattern of markers over the cloth. After the time t - t0 since the first frame, a
/// marker that is said to be at (s, t) is (velocity_s, velocity_t) (t - t0) further. It appears
/// where the surface is there, to second order (as in marker_placement). This stands for tags that
/// peel or for a tracker that is dragged along the weave. Parameters: velocity_s, velocity_t (m/s),
/// neutral at 0. Ours.
namespace clothfit::in_surface_sliding {

EffectDescription describe();
std::unique_ptr<MeasurementEffect> make();

}  // namespace clothfit::in_surface_sliding
