#include "fit/measurement_effects/dropped_frames.h"

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
                             .of_duration = true}}}}};
}

std::unique_ptr<MeasurementEffect> make() {
  return std::make_unique<DroppedFrames>();
}

}  // namespace clothfit::dropped_frames
