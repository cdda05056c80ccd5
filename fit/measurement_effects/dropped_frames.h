#pragma once

#include <memory>

#include "fit/measurement_effects/measurement_effect.h"
#include "model/cloth/effect.h"

/// Loses frames unnoticed: from a time on, everything was seen later than its frame's time says. A
/// frame of time t shows the cloth at
///
///   t + lost ramp((t - t0 - from) / d),  ramp(u) = u + 1/2 between 0 and 1,
///
/// t0 the first frame's time, d the median frame interval. For a loss between two frames `from` is
/// in the middle between them. Neither frame is then on the ramp, whose purpose is that a fit can
/// move `from` along. Parameters: lost (s), neutral at 0; from (s since the first frame), which
/// matters only where something is lost. Ours.
///
/// The cost has an optimum in `from` for every frame that the noise may make the first one after
/// the loss. A fit needs a prior, or a start, within a few frames of the truth.
namespace clothfit::dropped_frames {

EffectDescription describe();
std::unique_ptr<MeasurementEffect> make();

}  // namespace clothfit::dropped_frames
