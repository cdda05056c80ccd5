// Checks that a picture's reading row by row is found where it was planted.

#include <gtest/gtest.h>

#include "calib/camera/projection.h"
#include "fit/cost/objective.h"
#include "fit/problem/problem.h"
#include "tests/fit/measurement_contract.h"
#include "tests/fit/planted_effect.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

TEST(RollingShutter, KeepsToTheContract) {
  check_measurement_effect("rolling_shutter", synthetic_input({}));
}

TEST(RollingShutter, IsWhatACameraDeclares) {
  FitInput declared = synthetic_input({}), effect = synthetic_input({});
  declared.cameras.front().readout_time_s = 0.012;
  effect.recording.declared = {{.name = "rolling_shutter", .parameters = {{"readout", {0.012}}}}};
  const FitOptions pixels{.observations = ObservationKind::tracks2d};
  const FitProblem of_camera = make_problem(declared, pixels, 7, 7),
                   of_effect = make_problem(effect, pixels, 7, 7);
  const TrajectoryObjective seen(of_camera, 20, 1e-4), expected(of_effect, 20, 1e-4);
  const Eigen::VectorXd start = of_camera.space.start();

  ASSERT_TRUE(of_camera.reads_in_rows);
  const Eigen::VectorXd same = expected.residuals({start}).front();
  EXPECT_LT((seen.residuals({start}).front() - same).norm(), 1e-9 * same.norm());
  EXPECT_FALSE(why_readout_is_not_used(of_camera));

  // Tracks in space show no rows, and whoever declares a readout is not told of it for them.
  EXPECT_FALSE(make_problem(declared, {}, 7, 7).reads_in_rows);
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
