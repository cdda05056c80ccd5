// Checks that a wrong frame rate is found where it was planted.

#include <gtest/gtest.h>

#include "tests/fit/measurement_contract.h"
#include "tests/fit/planted_effect.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

TEST(FrameRateError, KeepsToTheContract) {
  check_measurement_effect("frame_rate_error", synthetic_input({}));
}

TEST(FrameRateError, IsFoundWhereItWasPlanted) {
  // Given a camera that takes 60 frames in 1.01 s
  constexpr double kExcess = 0.01;
  const auto seen = [](const SyntheticMotion& motion, double time_s,
                       const Eigen::Vector2d& place_m) {
    return motion((1 + kExcess) * time_s, place_m);
  };

  expect_found(synthetic_input({.seen = seen}),
               {.name = "frame_rate_error", .truth = {{"excess", kExcess}}});
}

}  // namespace
}  // namespace clothfit
