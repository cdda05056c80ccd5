// Checks that a wrong place of the pattern is found where it was planted.

#include <gtest/gtest.h>

#include "tests/fit/measurement_contract.h"
#include "tests/fit/planted_effect.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

constexpr double kShiftS = 0.002, kShiftT = -0.003, kStretchS = 0.01, kStretchT = -0.008,
                 kTurnedBy = 0.015;

TEST(MarkerPlacement, KeepsToTheContract) {
  check_measurement_effect("marker_placement", synthetic_input({}));
}

TEST(MarkerPlacement, IsFoundWhereItWasPlanted) {
  // Given a pattern on the inner part of the cloth, so that the true places lie on it too
  const auto seen = [](const SyntheticMotion& motion, double time_s,
                       const Eigen::Vector2d& place_m) {
    const Eigen::Vector2d from_middle = place_m - Eigen::Vector2d(0.2, 0.2);
    const Eigen::Vector2d shift(kShiftS + kStretchS * from_middle[0] - kTurnedBy * from_middle[1],
                                kShiftT + kStretchT * from_middle[1] + kTurnedBy * from_middle[0]);
    return motion(time_s, place_m + shift);
  };

  expect_found(synthetic_input({.marker_margin_m = 0.03, .seen = seen}),
               {.name = "marker_placement",
                .truth = {{"shift_s", kShiftS},
                          {"shift_t", kShiftT},
                          {"stretch_s", kStretchS},
                          {"stretch_t", kStretchT},
                          {"turn", kTurnedBy}}});
}

}  // namespace
}  // namespace clothfit
