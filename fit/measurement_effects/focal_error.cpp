#include "fit/measurement_effects/measurement_effect.h"
#include "model/cloth/effect.h"
#include "model/cloth/wording.h"

/// Makes the focal length differ from the calibrated one. A pixel at u appears at u + excess (u -
/// c), c the camera's principal point. Parameter: excess (1), neutral at 0. It applies to cameras
/// only, to all alike. Ours.
namespace clothfit::focal_error {
namespace {

class FocalError final : public MeasurementEffect {
 public:
  bool needs_camera() const override { return true; }

  void move_pixel(const Sighting& sighting, Parameters p, MeasuredPair& pixel) const override {
    pixel += (pixel - sighting.camera->centre_px.cast<MeasuredNumber>()) * p[0];
  }
};

/// Pixels that are further out by a factor are those of a focal length longer by it.
std::string in_words(const FittedEffect& found) {
  const double excess = found.value("excess");
  if (excess == 0) return {};
  return "the focal length is " + percent(excess, "longer", "shorter") + " than calibrated";
}

}  // namespace

EffectDescription describe() {
  return {.name = "focal_error",
          .summary = "pixels further from the principal point c by excess (u - c)",
          .parameters = {{.name = "excess",
                          .unit = "1",
                          .neutral = 0,
                          .lower = -0.2,
                          .upper = 0.2,
                          .typical = 1e-3}},
          .in_words = in_words};
}

std::unique_ptr<MeasurementEffect> make() {
  return std::make_unique<FocalError>();
}

}  // namespace clothfit::focal_error
