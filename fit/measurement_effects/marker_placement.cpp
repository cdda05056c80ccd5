#include "fit/measurement_effects/marker_placement.h"

namespace clothfit::marker_placement {
namespace {

class MarkerPlacement final : public MeasurementEffect {
 public:
  bool shifts_place() const override { return true; }

  void shift_place(const Sighting& sighting, Parameters p, MeasuredPair& shift_m) const override {
    const double s = sighting.from_pattern_middle_m[0], t = sighting.from_pattern_middle_m[1];
    shift_m[0] += p[0] + p[2] * s - p[4] * t;
    shift_m[1] += p[1] + p[3] * t + p[4] * s;
  }
};

}  // namespace

EffectDescription describe() {
  return {.name = "marker_placement",
          .summary = "the pattern of markers is shifted, stretched and turned on the cloth",
          .parameters = {{.name = "shift_s",
                          .unit = "m",
                          .neutral = 0,
                          .lower = -0.05,
                          .upper = 0.05,
                          .typical = 1e-3},
                         {.name = "shift_t",
                          .unit = "m",
                          .neutral = 0,
                          .lower = -0.05,
                          .upper = 0.05,
                          .typical = 1e-3},
                         {.name = "stretch_s",
                          .unit = "1",
                          .neutral = 0,
                          .lower = -0.2,
                          .upper = 0.2,
                          .typical = 2e-3},
                         {.name = "stretch_t",
                          .unit = "1",
                          .neutral = 0,
                          .lower = -0.2,
                          .upper = 0.2,
                          .typical = 2e-3},
                         {.name = "turn",
                          .unit = "rad",
                          .neutral = 0,
                          .lower = -0.2,
                          .upper = 0.2,
                          .typical = 2e-3}},
          .modes = {{.name = "shift", .amplitudes = {"shift_s", "shift_t"}, .shapes = {}},
                    {.name = "stretch", .amplitudes = {"stretch_s", "stretch_t"}, .shapes = {}},
                    {.name = "turn", .amplitudes = {"turn"}, .shapes = {}}}};
}

std::unique_ptr<MeasurementEffect> make() {
  return std::make_unique<MarkerPlacement>();
}

}  // namespace clothfit::marker_placement
