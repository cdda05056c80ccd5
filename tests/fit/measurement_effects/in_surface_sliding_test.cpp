// Checks that a pattern's sliding over the cloth is found where it was planted.

#include <gtest/gtest.h>

#include "tests/fit/measurement_contract.h"
#include "tests/fit/planted_effect.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

constexpr double kVelocityS = 0.008, kVelocityT = -0.005;

TEST(InSurfaceSliding, KeepsToTheContract) {
  check_measurement_effect("in_surface_sliding", synthetic_input({}));
}

TEST(InSurfaceSliding, IsFoundWhereItWasPlanted) {
  const auto seen = [](const SyntheticMotion& motion, double time_s,
                       const Eigen::Vector2d& place_m) {
    return motion(time_s, place_m + time_s * Eigen::Vector2d(kVelocityS, kVelocityT));
  };

  expect_found(synthetic_input({.marker_margin_m = 0.03, .seen = seen}),
               {.name = "in_surface_sliding",
                .truth = {{"velocity_s", kVelocityS}, {"velocity_t", kVelocityT}}});
}

}  // namespace
}  // namespace clothfit
