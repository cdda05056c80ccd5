#include <algorithm>
#include <iterator>

#include "fit/measurement_effects/rigid_change.h"
#include "model/cloth/wording.h"
#include "model/effects/harmonic.h"

/// Makes the camera shake, and the measured world with it: a marker at x appears at
///
///   c + R(turn s) (x - c) + shift s,
///   s = sin(2 pi (frequency t + phase)) - sin(2 pi (frequency t0 + phase)),
///
/// c is the middle of the placed sheet, R the turn by a rotation vector
/// (fit/measurement_effects/rigid_change.h), t the recording's time and t0 the first frame's.
/// Parameters: shift_x, shift_y, shift_z (m), turn_x, turn_y, turn_z (rad), neutral at 0; frequency
/// (Hz) and phase (turns), which matter only where these do. Several cameras all shake as one.
/// Ours.
namespace clothfit::camera_shake {
namespace {

class CameraShake final : public MeasurementEffect {
 public:
  void move(const Sighting& sighting, Parameters p, MeasuredPoint& position_m) const override {
    const MeasuredPoint shift(p[0], p[1], p[2]), turn(p[3], p[4], p[5]);
    const auto sine = [&](double time_s) { return sine_of_turns(p[6] * time_s + p[7]); };
    const MeasuredNumber s = sine(sighting.time_s) - sine(sighting.first_time_s);
    move_rigidly(sighting, turn * s, shift * s, position_m);
  }
};

std::string in_words(const FittedEffect& found) {
  const bool turns = found.mode == "turn";
  const Eigen::Vector3d amplitude = found.vector(turns ? "turn" : "shift");
  if (amplitude.isZero(0)) return {};
  const std::string size =
      turns ? rounded(turn_degrees(amplitude)) + " degrees" : millimetres(amplitude.norm());
  return size + " to either side " + (turns ? "about " : "along ") + unit_vector(amplitude) + ", " +
         rounded(found.value("frequency")) + " times a second";
}

}  // namespace

EffectDescription describe() {
  std::vector<EffectParameter> parameters = vector_parameter(
      {.name = "shift", .unit = "m", .neutral = 0, .lower = -0.1, .upper = 0.1, .typical = 1e-3});
  std::ranges::copy(Harmonic::parameters({.name = "turn",
                                          .unit = "rad",
                                          .neutral = 0,
                                          .lower = -0.1,
                                          .upper = 0.1,
                                          .typical = 2e-3}),
                    std::back_inserter(parameters));
  std::vector<EffectMode> modes;
  for (const char* amplitude : {"shift", "turn"}) {
    modes.push_back(Harmonic::modes(amplitude).front());
    modes.back().name = amplitude;
  }
  return {.name = "camera_shake",
          .summary = "the measured world shakes rigidly, with one harmonic",
          .parameters = std::move(parameters),
          .test = EffectTest::profiled,
          .modes = std::move(modes),
          .in_words = in_words};
}

std::unique_ptr<MeasurementEffect> make() {
  return std::make_unique<CameraShake>();
}

}  // namespace clothfit::camera_shake
