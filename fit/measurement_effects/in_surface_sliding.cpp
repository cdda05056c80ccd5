#include "fit/measurement_effects/measurement_effect.h"
#include "model/cloth/effect.h"
#include "model/cloth/wording.h"

/// Slides the pattern of markers over the cloth. After the time t - t0 since the first frame, a
/// marker that is said to be at (s, t) is (velocity_s, velocity_t) (t - t0) further. It appears
/// where the surface is there, to second order (as in marker_placement). This stands for tags that
/// peel or for a tracker that is dragged along the weave. Parameters: velocity_s, velocity_t (m/s),
/// neutral at 0. Ours.
namespace clothfit::in_surface_sliding {
namespace {

class InSurfaceSliding final : public MeasurementEffect {
 public:
  bool shifts_place() const override { return true; }

  void shift_place(const Sighting& sighting, Parameters p, MeasuredPair& shift_m) const override {
    for (Eigen::Index d = 0; d < 2; ++d)
      shift_m[d] += p[static_cast<size_t>(d)] * sighting.since_first_s();
  }
};

std::string in_words(const FittedEffect& found) {
  const std::string way = way_over_cloth(
      found.duration_s() * Eigen::Vector2d(found.value("velocity_s"), found.value("velocity_t")));
  return way.empty() ? way : "the pattern slides " + way + " by the end";
}

}  // namespace

EffectDescription describe() {
  return {.name = "in_surface_sliding",
          .summary = "the pattern of markers slides over the cloth at a steady velocity",
          .parameters = {{.name = "velocity_s",
                          .unit = "m/s",
                          .neutral = 0,
                          .lower = -0.1,
                          .upper = 0.1,
                          .typical = 1e-3},
                         {.name = "velocity_t",
                          .unit = "m/s",
                          .neutral = 0,
                          .lower = -0.1,
                          .upper = 0.1,
                          .typical = 1e-3}},
          .in_words = in_words};
}

std::unique_ptr<MeasurementEffect> make() {
  return std::make_unique<InSurfaceSliding>();
}

}  // namespace clothfit::in_surface_sliding
