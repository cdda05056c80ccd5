// Checks that smoothing of the tracks is found where it was planted.

#include <gtest/gtest.h>

#include "tests/fit/measurement_contract.h"
#include "tests/fit/planted_effect.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

TEST(TemporalSmoothing, KeepsToTheContract) {
  check_measurement_effect("temporal_smoothing", synthetic_input({}));
}

TEST(TemporalSmoothing, IsFoundWhereTracksAreMeansOfThreeFrames) {
  const auto seen = [](const SyntheticMotion& motion, double time_s,
                       const Eigen::Vector2d& place_m) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const double frames : {-1, 0, 1}) sum += motion(time_s + frames / 60, place_m);
    return Eigen::Vector3d(sum / 3);
  };

  expect_found(synthetic_input({.seen = seen}),
               {.name = "temporal_smoothing", .truth = {{"w", 1.0 / 3}}});
}

}  // namespace
}  // namespace clothfit
