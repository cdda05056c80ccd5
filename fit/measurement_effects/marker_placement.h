#pragma once

#include <memory>

#include "fit/measurement_effects/measurement_effect.h"
#include "model/cloth/effect.h"

/// Places the pattern of markers elsewhere on the cloth than stated. A marker that is said to be at
/// (s, t) is at (s + ds, t + dt),
///
///   ds = shift_s + stretch_s (s - s_m) - turn (t - t_m)
///   dt = shift_t + stretch_t (t - t_m) + turn (s - s_m),
///
/// (s_m, t_m) the mean of all markers. It appears where the surface is there, to second order:
///
///   x + x_s ds + x_t dt + x_ss ds^2 / 2 + x_st ds dt + x_tt dt^2 / 2
///
/// First order would miss 0.1 mm at a curvature of 10 /m and 5 mm. Parameters: shift_s, shift_t
/// (m), stretch_s, stretch_t (1), turn (rad), neutral at 0. Ours.
namespace clothfit::marker_placement {

EffectDescription describe();
std::unique_ptr<MeasurementEffect> make();

}  // namespace clothfit::marker_placement
