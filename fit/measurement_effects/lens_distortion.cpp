#include "fit/measurement_effects/lens_distortion.h"

namespace clothfit::lens_distortion {
namespace {

class LensDistortion final : public MeasurementEffect {
 public:
  bool needs_camera() const override { return true; }

  void move_pixel(const Sighting& sighting, Parameters p, MeasuredPair& pixel) const override {
    const MeasuredPair from_centre = pixel - sighting.camera->centre_px.cast<MeasuredNumber>();
    const MeasuredNumber x = from_centre[0] / sighting.camera->focal_px[0];
    const MeasuredNumber y = from_centre[1] / sighting.camera->focal_px[1];
    pixel += from_centre * (p[0] * (x * x + y * y));
  }
};

}  // namespace

EffectDescription describe() {
  return {.name = "lens_distortion",
          .summary = "pixels further out by k1 r^2 (u - c), r in focal lengths from the centre c",
          .parameters = {
              {.name = "k1", .unit = "1", .neutral = 0, .lower = -1, .upper = 1, .typical = 1e-3}}};
}

std::unique_ptr<MeasurementEffect> make() {
  return std::make_unique<LensDistortion>();
}

}  // namespace clothfit::lens_distortion
