#include "fit/measurement_effects/frame_rate_error.h"

namespace clothfit::frame_rate_error {
namespace {

class FrameRateError final : public MeasurementEffect {
 public:
  bool shifts_time() const override { return true; }

  void shift_time(const Sighting& sighting, Parameters p, MeasuredNumber& seen_s) const override {
    seen_s += p[0] * sighting.since_first_s();
  }
};

}  // namespace

EffectDescription describe() {
  return {.name = "frame_rate_error",
          .summary = "a frame of time t shows the cloth at t0 + (1 + excess) (t - t0)",
          .parameters = {{.name = "excess",
                          .unit = "1",
                          .neutral = 0,
                          .lower = -0.2,
                          .upper = 0.2,
                          .typical = 1e-3}}};
}

std::unique_ptr<MeasurementEffect> make() {
  return std::make_unique<FrameRateError>();
}

}  // namespace clothfit::frame_rate_error
