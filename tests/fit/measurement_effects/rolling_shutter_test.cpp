// Checks that a picture's reading row by row is found where it was planted.

#include <gtest/gtest.h>

#include "calib/camera/projection.h"
#include "tests/fit/measurement_contract.h"
#include "tests/fit/planted_effect.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

TEST(RollingShutter, KeepsToTheContract) {
  check_measurement_effect("rolling_shutter", synthetic_input({}));
}

TEST(RollingShutter, IsFoundWhereItWasPlanted) {
  constexpr double kReadoutS = 0.012;
  const auto seen = [](const SyntheticMotion& motion, double time_s,
                       const Eigen::Vector2d& place_m) {
    // A marker is in the row that is read when it is there. Few rounds find it, as it crosses a
    // hundredth of the rows while all are read.
    const CameraParameters camera = synthetic_camera();
    Eigen::Vector3d point = motion(time_s, place_m);
    for (int round = 0; round < 8; ++round) {
      const double row = project(camera, camera_from_world(camera) * point)->y();
      point = motion(time_s + kReadoutS * (row / camera.image_height - 0.5), place_m);
    }
    return point;
  };

  expect_found(synthetic_input({.seen = seen}), {.name = "rolling_shutter",
                                                 .truth = {{"readout", kReadoutS}},
                                                 .observations = ObservationKind::tracks2d});
}

}  // namespace
}  // namespace clothfit
