// Checks that a wrong "down" is found where it was planted, and as gravity that is tilted.

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "tests/fit/measurement_contract.h"
#include "tests/fit/planted_effect.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

constexpr double kAboutX = 0.03, kAboutY = -0.02;

/// Returns the middle of the sheet, where it was let go.
Eigen::Vector3d middle_m(const SyntheticMotion& motion) {
  return motion(0, {0.2, 0.2});
}

TEST(WorldTilt, KeepsToTheContract) {
  check_measurement_effect("world_tilt", synthetic_input({}));
}

FitInput tilted_input() {
  return synthetic_input(
      {.seen = [](const SyntheticMotion& motion, double time_s, const Eigen::Vector2d& place_m) {
        const Eigen::Vector3d turn(kAboutX, kAboutY, 0);
        const Eigen::Vector3d middle = middle_m(motion);
        return Eigen::Vector3d(middle + Eigen::AngleAxisd(turn.norm(), turn.normalized()) *
                                            (motion(time_s, place_m) - middle));
      }});
}

TEST(WorldTilt, IsFoundWhereItWasPlanted) {
  expect_found(tilted_input(),
               {.name = "world_tilt", .truth = {{"about_x", kAboutX}, {"about_y", kAboutY}}});
}

TEST(WorldTilt, IsGravityTiltOfTheSameAnglesWhereTheSheetIsPlacedByWhatIsSeen) {
  expect_found(tilted_input(),
               {.name = "gravity_tilt", .truth = {{"about_x", kAboutX}, {"about_y", kAboutY}}});
}

}  // namespace
}  // namespace clothfit
