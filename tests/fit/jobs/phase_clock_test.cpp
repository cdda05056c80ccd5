// Checks that clock time is added up by phase.
#include "fit/jobs/phase_clock.h"

#include <gtest/gtest.h>

namespace clothfit {
namespace {

TEST(PhaseClock, AddsUpTheTurnsOfAPhase) {
  const auto began = std::chrono::steady_clock::now();
  PhaseClock clock;
  clock.enter("fits");
  clock.enter("trials");
  clock.enter("fits");
  const std::vector<PhaseTime> times = clock.times();
  const double all_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();

  ASSERT_EQ(times.size(), 2u);
  EXPECT_EQ(times[0].name, "fits");
  EXPECT_EQ(times[1].name, "trials");
  EXPECT_GE(times[0].seconds, 0);
  EXPECT_LE(times[0].seconds + times[1].seconds, all_s);
  // The phase that runs goes on counting.
  EXPECT_GE(clock.times()[0].seconds, times[0].seconds);
}

TEST(PhaseClock, HasNoPhaseBeforeTheFirst) {
  PhaseClock clock;
  EXPECT_TRUE(clock.times().empty());
}

}  // namespace
}  // namespace clothfit
