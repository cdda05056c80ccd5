#include "fit/measurement_effects/rigid_change.h"
#include "model/cloth/effect.h"
#include "model/cloth/wording.h"

/// Turns the measured world about the middle c of the placed sheet, because "down" was taken from a
/// wrong direction. A marker at x appears at c + R (x - c), R the turn about the world's axes x and
/// y by two small angles (fit/measurement_effects/rigid_change.h). Parameters: about_x, about_y
/// (rad), neutral at 0. Ours.
///
/// It is equivalent to gravity_tilt of the same angles in one case: the sheet's first pose is
/// fitted along (a cloth let go flat) and nothing but weight knows a direction. The sheet begins
/// turned by R' and falls along g, and is seen to begin unturned and to fall along R g. Elsewhere
/// the sheet and its supports are placed by what is seen, turned already; there only gravity_tilt
/// is right.
namespace clothfit::world_tilt {
namespace {

class WorldTilt final : public MeasurementEffect {
 public:
  void move(const Sighting& sighting, Parameters p, MeasuredPoint& position_m) const override {
    const MeasuredNumber none(0.0);
    move_rigidly(sighting, {p[0], p[1], none}, {none, none, none}, position_m);
  }
};

std::string in_words(const FittedEffect& found) {
  const Eigen::Vector3d turn_rad(found.value("about_x"), found.value("about_y"), 0);
  if (turn_rad.isZero(0)) return {};
  return "what is measured is turned by " + rounded(turn_degrees(turn_rad)) + " degrees about " +
         unit_vector(turn_rad);
}

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
                          .typical = 1e-3}},
          .remedy = "level the camera's or the tracker's axes against gravity",
          .in_words = in_words};
}

std::unique_ptr<MeasurementEffect> make() {
  return std::make_unique<WorldTilt>();
}

}  // namespace clothfit::world_tilt
