#include "fit/measurement_effects/measurement_effect.h"
#include "model/cloth/effect.h"
#include "model/cloth/wording.h"

/// Makes the lens bend more than its calibration says: a pixel at u appears at
///
///   u + k1 r^2 (u - c),  r^2 = ((u_x - c_x) / f_x)^2 + ((u_y - c_y) / f_y)^2,
///
/// c is the principal point and f the focal lengths of the camera. Parameter: k1 (1), neutral at 0.
/// To first order it changes the k1 of [brown1971]. It applies to cameras only, to all alike. Ours.
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

/// Tells the relative shift k1 r^2 at r = 1/2, a common picture's edge.
std::string in_words(const FittedEffect& found) {
  constexpr double kFocalLengths = 0.5;
  const double k1 = found.value("k1");
  if (k1 == 0) return {};
  return "half a focal length from the middle, pixels are " +
         percent(k1 * kFocalLengths * kFocalLengths, "further out", "further in");
}

}  // namespace

EffectDescription describe() {
  return {.name = "lens_distortion",
          .summary = "pixels further out by k1 r^2 (u - c), r in focal lengths from the centre c",
          .parameters =
              {{.name = "k1", .unit = "1", .neutral = 0, .lower = -1, .upper = 1, .typical = 1e-3}},
          .in_words = in_words};
}

std::unique_ptr<MeasurementEffect> make() {
  return std::make_unique<LensDistortion>();
}

}  // namespace clothfit::lens_distortion
