#include "fit/measurement_effects/world_tilt.h"

#include "fit/measurement_effects/rigid_change.h"

namespace clothfit::world_tilt {
namespace {

class WorldTilt final : public MeasurementEffect {
 public:
  void move(const Sighting& sighting, Parameters p, MeasuredPoint& position_m) const override {
    const MeasuredNumber none(0.0);
    move_rigidly(sighting, {p[0], p[1], none}, {none, none, none}, position_m);
  }
};

}  // namespace

EffectDescription describe() {
  return {.name = "world_tilt",
          .summary = "what is measured is turned about the axes x and y through the sheet's middle",
          .parameters = {{.name = "about_x",
                          .unit = "rad",
                          .neutral = 0,
                          .lower = -0.3,
                          .upper = 0.3,
                          .typical = 1e-3},
                         {.name = "about_y",
                          .unit = "rad",
                          .neutral = 0,
                          .lower = -0.3,
                          .upper = 0.3,
                          .typical = 1e-3}}};
}

std::unique_ptr<MeasurementEffect> make() {
  return std::make_unique<WorldTilt>();
}

}  // namespace clothfit::world_tilt
