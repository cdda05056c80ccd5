// Checks that a wrong focal length is found where it was planted.

#include <gtest/gtest.h>

#include "tests/fit/measurement_contract.h"
#include "tests/fit/planted_effect.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

TEST(FocalError, KeepsToTheContract) {
  check_measurement_effect("focal_error", synthetic_input({}));
}

TEST(FocalError, IsFoundWhereItWasPlanted) {
  constexpr double kExcess = 0.03;
  const auto pixel = [](const Eigen::Vector2d& at) {
    const Eigen::Vector2d centre(480, 360);
    return Eigen::Vector2d(centre + (1 + kExcess) * (at - centre));
  };

  expect_found(synthetic_input({.pixel = pixel}), {.name = "focal_error",
                                                   .truth = {{"excess", kExcess}},
                                                   .observations = ObservationKind::tracks2d});
}

}  // namespace
}  // namespace clothfit
