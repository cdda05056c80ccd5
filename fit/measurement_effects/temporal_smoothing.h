#pragma once

#include <memory>

#include "fit/measurement_effects/measurement_effect.h"
#include "model/cloth/effect.h"

/// Smooths the tracks over time: a marker appears at
///
///   x(t) + w (x(t + d) - 2 x(t) + x(t - d)),
///
/// d is the median frame interval. To the leading order any even kernel of variance v (s2) does
/// this, with w = v / (2 d^2): its mean of x is x + v/2 d2x/dt2. A running mean of three frames has
/// w = 1/3, one of 2 n + 1 frames n (n + 1) / 6. Places are mixed, not pixels. Parameter: w (1),
/// neutral at 0, which is its lower bound. Ours.
namespace clothfit::temporal_smoothing {

EffectDescription describe();
std::unique_ptr<MeasurementEffect> make();

}  // namespace clothfit::temporal_smoothing
