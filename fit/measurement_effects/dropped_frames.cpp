#include <cmath>

#include "fit/measurement_effects/measurement_effect.h"
#include "model/cloth/effect.h"
#include "model/cloth/wording.h"

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
namespace {

class DroppedFrames final : public MeasurementEffect {
 public:
  bool shifts_time() const override { return true; }

  void shift_time(const Sighting& sighting, Parameters p, MeasuredNumber& seen_s) const override {
    const MeasuredNumber intervals_past =
        (sighting.since_first_s() - p[1]) / sighting.frame_interval_s;
    const MeasuredNumber share = intervals_past + 0.5;
    if (share > 0.0) seen_s += share < 1.0 ? p[0] * share : p[0];
  }
};

std::string in_words(const FittedEffect& found) {
  const double lost_s = found.value("lost");
  if (lost_s == 0) return {};
  return rounded(std::abs(lost_s) / found.frame_interval_s) + " frames " +
         (lost_s > 0 ? "lost " : "too many ") + rounded(found.value("from")) +
         " s after the first one";
}

}  // namespace

EffectDescription describe() {
  return {
      .name = "dropped_frames",
      .summary = "everything after the time t0 + from was seen later by the time that was lost",
      .parameters =
          {{.name = "lost",
            .unit = "s",
            .neutral = 0,
            .lower = -0.5,
            .upper = 0.5,
            .typical = 1e-3},
           {.name = "from", .unit = "s", .neutral = 0, .lower = 0, .upper = 3600, .typical = 0.01}},
      .test = EffectTest::profiled,
      .modes = {{.name = "",
                 .amplitudes = {"lost"},
                 .shapes = {{.parameter = "from",
                             .values = {0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9},
                             .of_duration = true}}}},
      .in_words = in_words};
}

std::unique_ptr<MeasurementEffect> make() {
  return std::make_unique<DroppedFrames>();
}

}  // namespace clothfit::dropped_frames
