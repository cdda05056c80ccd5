#include "fit/measurement_effects/measurement_effect.h"
#include "model/cloth/effect.h"
#include "model/cloth/wording.h"

/// Makes the frame rate differ from the stated one. A frame of time t shows the cloth at t0 + (1 +
/// excess) (t - t0), t0 the first frame's time. Parameter: excess (1), neutral at 0. Ours.
///
/// With still supports, and stiffness and damping free, it is equivalent to gravity_scale. A clock
/// that is fast by 1 + e shows g, K / m and c / m as (1 + e)^2 g, (1 + e)^2 K / m and (1 + e) c /
/// m.
namespace clothfit::frame_rate_error {
namespace {

class FrameRateError final : public MeasurementEffect {
 public:
  bool shifts_time() const override { return true; }

  void shift_time(const Sighting& sighting, Parameters p, MeasuredNumber& seen_s) const override {
    seen_s += p[0] * sighting.since_first_s();
  }
};

std::string in_words(const FittedEffect& found) {
  const double excess = found.value("excess");
  if (excess == 0) return {};
  const double stated_hz = 1 / found.frame_interval_s;
  return "frames are " + percent(excess, "longer", "shorter") +
         " than stated: " + rounded(stated_hz / (1 + excess)) + " a second, stated " +
         rounded(stated_hz);
}

}  // namespace

EffectDescription describe() {
  return {.name = "frame_rate_error",
          .summary = "a frame of time t shows the cloth at t0 + (1 + excess) (t - t0)",
          .parameters = {{.name = "excess",
                          .unit = "1",
                          .neutral = 0,
                          .lower = -0.2,
                          .upper = 0.2,
                          .typical = 1e-3}},
          .remedy = "check the declared frame_rate against the file",
          .in_words = in_words};
}

std::unique_ptr<MeasurementEffect> make() {
  return std::make_unique<FrameRateError>();
}

}  // namespace clothfit::frame_rate_error
