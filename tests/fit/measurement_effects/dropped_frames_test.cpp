// Checks that lost frames are found where they were, as many as there were.

#include <gtest/gtest.h>

#include "tests/fit/measurement_contract.h"
#include "tests/fit/planted_effect.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

TEST(DroppedFrames, KeepsToTheContract) {
  check_measurement_effect("dropped_frames", synthetic_input({}));
}

// Two frames are lost after the twelfth.
constexpr double kLostS = 2.0 / 60, kFromS = 11.5 / 60;

FitInput with_frames_lost() {
  return synthetic_input(
      {.seen = [](const SyntheticMotion& motion, double time_s, const Eigen::Vector2d& place_m) {
        return motion(time_s > kFromS ? time_s + kLostS : time_s, place_m);
      }});
}

TEST(DroppedFrames, AreFoundWhereItIsKnownWhen) {
  FitInput input = with_frames_lost();
  input.recording.declared = {{.name = "dropped_frames", .parameters = {{"from", {kFromS}}}}};

  expect_found(input, {.name = "dropped_frames", .truth = {{"lost", kLostS}}});
}

TEST(DroppedFrames, AreFoundFromAGuessThreeFramesOff) {
  expect_found(with_frames_lost(), {.name = "dropped_frames",
                                    .truth = {{"lost", kLostS}, {"from", kFromS}},
                                    .priors = {{"dropped_frames.from", 14.4 / 60, 0.05}}});
}

}  // namespace
}  // namespace clothfit
