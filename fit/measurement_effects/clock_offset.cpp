#include "fit/measurement_effects/measurement_effect.h"
#include "model/cloth/effect.h"

/// Makes the camera's clock late against that of the drive. An observation of time t shows the
/// cloth at t + time. Parameter: time (s), neutral at 0. Ours.
namespace clothfit::clock_offset {
namespace {

class ClockOffset final : public MeasurementEffect {
 public:
  bool shifts_time() const override { return true; }

  void shift_time(const Sighting&, Parameters p, MeasuredNumber& seen_s) const override {
    seen_s += p[0];
  }
};

}  // namespace

EffectDescription describe() {
  return {.name = "clock_offset",
          .summary = "an observation of time t shows the cloth at t + time",
          .parameters = {{.name = "time",
                          .unit = "s",
                          .neutral = 0,
                          .lower = -0.2,
                          .upper = 0.2,
                          .typical = 1e-3}},
          .remedy = "measure the offset between the clocks of camera and drive, and declare it"};
}

std::unique_ptr<MeasurementEffect> make() {
  return std::make_unique<ClockOffset>();
}

}  // namespace clothfit::clock_offset
