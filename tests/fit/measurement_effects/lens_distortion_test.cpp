// Checks that a lens that bends more than stated is found where it was planted.

#include <gtest/gtest.h>

#include "tests/fit/measurement_contract.h"
#include "tests/fit/planted_effect.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

TEST(LensDistortion, KeepsToTheContract) {
  check_measurement_effect("lens_distortion", synthetic_input({}));
}

TEST(LensDistortion, IsFoundWhereItWasPlanted) {
  constexpr double kK1 = 0.05;
  const auto pixel = [](const Eigen::Vector2d& at) {
    const Eigen::Vector2d from_centre = at - Eigen::Vector2d(480, 360);
    const double radius = from_centre.norm() / 1000;
    return Eigen::Vector2d(at + kK1 * radius * radius * from_centre);
  };

  expect_found(synthetic_input({.pixel = pixel}), {.name = "lens_distortion",
                                                   .truth = {{"k1", kK1}},
                                                   .observations = ObservationKind::tracks2d});
}

}  // namespace
}  // namespace clothfit
