#include <cmath>

#include "fit/measurement_effects/measurement_effect.h"
#include "model/cloth/effect.h"
#include "model/cloth/wording.h"

/// Makes the camera read its picture row by row. A pixel in row y of H is seen readout (y / H -
/// 1/2) later than its frame's time says, which is that of the middle row. The row is that of the
/// observed pixel, whose noise moves the time by less than a thousandth of the readout. Parameter:
/// readout (s), neutral at 0; negative where the last row is read first. It applies to cameras
/// only, to all alike. Ours.
namespace clothfit::rolling_shutter {
namespace {

class RollingShutter final : public MeasurementEffect {
 public:
  bool shifts_time() const override { return true; }
  bool needs_camera() const override { return true; }

  void shift_time(const Sighting& sighting, Parameters p, MeasuredNumber& seen_s) const override {
    seen_s += p[0] * (sighting.observed_row_px / sighting.camera->image_height - 0.5);
  }
};

std::string in_words(const FittedEffect& found) {
  const double readout_s = found.value("readout");
  if (readout_s == 0) return {};
  return rounded(1e3 * std::abs(readout_s)) + " ms from the " +
         (readout_s > 0 ? "top row to the bottom row" : "bottom row to the top row");
}

}  // namespace

EffectDescription describe() {
  return {.name = "rolling_shutter",
          .summary = "a pixel in row y of H is seen readout (y / H - 1/2) later",
          .parameters = {{.name = "readout",
                          .unit = "s",
                          .neutral = 0,
                          .lower = -0.05,
                          .upper = 0.05,
                          .typical = 1e-3}},
          .remedy = "declare readout_time in the camera file",
          .in_words = in_words};
}

std::unique_ptr<MeasurementEffect> make() {
  return std::make_unique<RollingShutter>();
}

}  // namespace clothfit::rolling_shutter
