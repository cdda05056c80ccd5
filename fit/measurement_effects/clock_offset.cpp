#include <cmath>

#include "fit/measurement_effects/measurement_effect.h"
#include "model/cloth/effect.h"
#include "model/cloth/wording.h"

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

std::string in_words(const FittedEffect& found) {
  const double late_s = found.value("time");
  if (late_s == 0) return {};
  return "frames show the cloth " + rounded(1e3 * std::abs(late_s)) + " ms (" +
         rounded(std::abs(late_s) / found.frame_interval_s) + " frames) " +
         (late_s > 0 ? "later" : "earlier") + " than their times say";
}

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
          .remedy = "measure the offset between the clocks of camera and drive, and declare it",
          .in_words = in_words};
}

std::unique_ptr<MeasurementEffect> make() {
  return std::make_unique<ClockOffset>();
}

}  // namespace clothfit::clock_offset
