#include "fit/measurement_effects/in_surface_sliding.h"

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
                          .typical = 1e-3}}};
}

std::unique_ptr<MeasurementEffect> make() {
  return std::make_unique<InSurfaceSliding>();
}

}  // namespace clothfit::in_surface_sliding
