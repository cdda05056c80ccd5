#include "fit/measurement_effects/temporal_smoothing.h"

namespace clothfit::temporal_smoothing {
namespace {

class TemporalSmoothing final : public MeasurementEffect {
 public:
  bool mixes_neighbours() const override { return true; }

  void mix_neighbours(const Sighting&, Parameters p, MeasuredNumber& weight) const override {
    weight += p[0];
  }
};

}  // namespace

EffectDescription describe() {
  return {.name = "temporal_smoothing",
          .summary = "tracks smoothed over time: x + w (x(t + d) - 2 x + x(t - d))",
          .parameters = {
              {.name = "w", .unit = "1", .neutral = 0, .lower = 0, .upper = 1, .typical = 0.01}}};
}

std::unique_ptr<MeasurementEffect> make() {
  return std::make_unique<TemporalSmoothing>();
}

}  // namespace clothfit::temporal_smoothing
