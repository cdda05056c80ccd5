#include <algorithm>
#include <iterator>

#include "fit/measurement_effects/rigid_change.h"
#include "model/cloth/effect.h"
#include "model/cloth/wording.h"
#include "model/effects/vector_parameter.h"

/// Makes the camera creep, and the measured world with it: a marker at x appears at
///
///   c + R(turn_rate (t - t0)) (x - c) + velocity (t - t0),
///
/// c is the middle of the placed sheet, R the turn by a rotation vector
/// (fit/measurement_effects/rigid_change.h), t0 the first frame's time. Parameters: velocity_x,
/// velocity_y, velocity_z (m/s), turn_rate_x, turn_rate_y, turn_rate_z (rad/s), neutral at 0.
/// Several cameras all drift as one. Ours.
namespace clothfit::camera_drift {
namespace {

class CameraDrift final : public MeasurementEffect {
 public:
  void move(const Sighting& sighting, Parameters p, MeasuredPoint& position_m) const override {
    const MeasuredNumber since_first_s(sighting.since_first_s());
    const MeasuredPoint velocity(p[0], p[1], p[2]), turn_rate(p[3], p[4], p[5]);
    move_rigidly(sighting, turn_rate * since_first_s, velocity * since_first_s, position_m);
  }
};

/// Tells how far the measured world has gone, or turned, at the last frame.
std::string in_words(const FittedEffect& found) {
  if (found.mode == "turn") {
    const Eigen::Vector3d turn_rad = found.duration_s() * found.vector("turn_rate");
    if (turn_rad.isZero(0)) return {};
    return rounded(turn_degrees(turn_rad)) + " degrees about " + unit_vector(turn_rad) +
           " by the end";
  }
  const Eigen::Vector3d shift_m = found.duration_s() * found.vector("velocity");
  if (shift_m.isZero(0)) return {};
  return millimetres(shift_m.norm()) + " towards " + unit_vector(shift_m) + " by the end";
}

}  // namespace

EffectDescription describe() {
  std::vector<EffectParameter> parameters = vector_parameter({.name = "velocity",
                                                              .unit = "m/s",
                                                              .neutral = 0,
                                                              .lower = -0.2,
                                                              .upper = 0.2,
                                                              .typical = 1e-3});
  std::ranges::copy(vector_parameter({.name = "turn_rate",
                                      .unit = "rad/s",
                                      .neutral = 0,
                                      .lower = -0.5,
                                      .upper = 0.5,
                                      .typical = 2e-3}),
                    std::back_inserter(parameters));
  return {.name = "camera_drift",
          .summary = "the measured world drifts rigidly from the first frame on",
          .parameters = std::move(parameters),
          .modes = {{.name = "shift",
                     .amplitudes = {"velocity_x", "velocity_y", "velocity_z"},
                     .shapes = {}},
                    {.name = "turn",
                     .amplitudes = {"turn_rate_x", "turn_rate_y", "turn_rate_z"},
                     .shapes = {}}},
          .in_words = in_words};
}

std::unique_ptr<MeasurementEffect> make() {
  return std::make_unique<CameraDrift>();
}

}  // namespace clothfit::camera_drift
