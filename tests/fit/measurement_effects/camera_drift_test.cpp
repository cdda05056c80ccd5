// Checks that a creeping camera is found where it was planted.

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "tests/fit/measurement_contract.h"
#include "tests/fit/planted_effect.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

const Eigen::Vector3d kVelocity(0.02, -0.015, 0.01), kTurnRate(0.1, 0.06, -0.08);

TEST(CameraDrift, KeepsToTheContract) {
  check_measurement_effect("camera_drift", synthetic_input({}));
}

TEST(CameraDrift, IsFoundWhereItWasPlanted) {
  const auto seen = [](const SyntheticMotion& motion, double time_s,
                       const Eigen::Vector2d& place_m) {
    const Eigen::Vector3d middle = motion(0, {0.2, 0.2});
    const Eigen::Vector3d turn = time_s * kTurnRate;
    const Eigen::AngleAxisd turned(turn.norm(), kTurnRate.normalized());
    return Eigen::Vector3d(middle + turned * (motion(time_s, place_m) - middle) +
                           time_s * kVelocity);
  };

  expect_found(synthetic_input({.seen = seen}), {.name = "camera_drift",
                                                 .truth = {{"velocity_x", kVelocity.x()},
                                                           {"velocity_y", kVelocity.y()},
                                                           {"velocity_z", kVelocity.z()},
                                                           {"turn_rate_x", kTurnRate.x()},
                                                           {"turn_rate_y", kTurnRate.y()},
                                                           {"turn_rate_z", kTurnRate.z()}}});
}

}  // namespace
}  // namespace clothfit
