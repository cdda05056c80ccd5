// Checks that a shaking camera is found where it was planted.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "tests/fit/measurement_contract.h"
#include "tests/fit/planted_effect.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

const Eigen::Vector3d kShift(0.004, -0.003, 0.003), kTurn(0.01, 0.012, -0.008);
constexpr double kFrequencyHz = 5.6, kPhase = 0.1;

TEST(CameraShake, KeepsToTheContract) {
  check_measurement_effect("camera_shake", synthetic_input({}));
}

TEST(CameraShake, IsFoundWhereItWasPlanted) {
  const auto seen = [](const SyntheticMotion& motion, double time_s,
                       const Eigen::Vector2d& place_m) {
    const Eigen::Vector3d middle = motion(0, {0.2, 0.2});
    const auto sine = [](double turns) { return std::sin(2 * std::numbers::pi * turns); };
    const double s = sine(kFrequencyHz * time_s + kPhase) - sine(kPhase);
    const Eigen::AngleAxisd turned(s * kTurn.norm(), kTurn.normalized());
    return Eigen::Vector3d(middle + turned * (motion(time_s, place_m) - middle) + s * kShift);
  };

  expect_found(synthetic_input({.seen = seen}),
               {.name = "camera_shake",
                .truth = {{"shift_x", kShift.x()},
                          {"shift_y", kShift.y()},
                          {"shift_z", kShift.z()},
                          {"turn_x", kTurn.x()},
                          {"turn_y", kTurn.y()},
                          {"turn_z", kTurn.z()},
                          {"frequency", kFrequencyHz},
                          {"phase", kPhase}},
                // Half a turn more is the other sign.
                .priors = {{"camera_shake.frequency", 5, 0.5}, {"camera_shake.phase", 0, 0.2}}});
}

}  // namespace
}  // namespace clothfit
