// Checks that every run over time steps can be ended within a step's reach of when it is asked to.
// Not checked here: that a program ends (tests/apps/program_ending_test.cpp), and that fits hand
// the check on (tests/fit/cancelled_fit_test.cpp).

#include "model/integrate/stop_check.h"

#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <stdexcept>

#include "model/effects/registry.h"
#include "model/integrate/adjoint.h"
#include "model/integrate/divergence.h"
#include "model/integrate/relax.h"
#include "model/integrate/simulate.h"
#include "model/integrate/tangents.h"
#include "tests/model/hung_cloth.h"
#include "tests/model/random_cloth.h"

namespace clothfit {
namespace {

/// One frame interval of as many steps: nothing but a check within it can end a run.
Schedule one_interval(int steps) {
  return {.frame_time_s = {0, steps * 1e-6}, .time_step_s = 1e-6};
}

/// A kind of run, which takes some spring-steps in one interval.
struct Kind {
  const char* name;
  /// Runs to the end or until the check says so; returns whether the result can be used.
  std::function<bool(const Cloth&, const ParameterSet&, const Schedule&, const StopCheck&)> run;
};

std::vector<Kind> kinds() {
  const auto still = [](const Cloth& cloth) {
    return std::vector<Direction>(
        3, Direction{.effects = std::vector<std::vector<double>>(cloth.effects.size())});
  };
  return {
      {"simulate",
       [](const Cloth& cloth, const ParameterSet& set, const Schedule& schedule,
          const StopCheck& stop) {
         return simulate(cloth, {&set, 1}, schedule, Precision::exact, {}, stop).front().usable();
       }},
      {"simulate in lanes",
       [](const Cloth& cloth, const ParameterSet& set, const Schedule& schedule,
          const StopCheck& stop) {
         const std::vector<ParameterSet> sets(kLanes, set);
         return simulate(cloth, sets, schedule, Precision::fast, {}, stop).back().usable();
       }},
      {"simulate_with_tangents",
       [=](const Cloth& cloth, const ParameterSet& set, const Schedule& schedule,
           const StopCheck& stop) {
         const std::vector<Direction> along = still(cloth);
         return simulate_with_tangents(cloth, set, along, schedule, stop).run.usable();
       }},
      {"simulate_with_fields",
       [](const Cloth& cloth, const ParameterSet& set, const Schedule& schedule,
          const StopCheck& stop) {
         return simulate_with_fields(cloth, set, schedule, {}, stop).usable();
       }},
      {"simulate_with_gradient",
       [](const Cloth& cloth, const ParameterSet& set, const Schedule& schedule,
          const StopCheck& stop) {
         const auto cost = [](int, const Eigen::Matrix3Xd& position_m) { return position_m; };
         return simulate_with_gradient(cloth, set, schedule, {}, cost, stop).run.usable();
       }},
      {"relax",
       [](const Cloth& cloth, const ParameterSet& set, const Schedule& schedule,
          const StopCheck& stop) {
         const double longest_s = 1.4 / (schedule.frame_time_s.back() / schedule.time_step_s);
         return relax(cloth, {&set, 1}, 9.81, 0, longest_s, stop).front().position_m.allFinite();
       }},
      {"start_at_rest_with_tangents",
       [=](const Cloth& cloth, ParameterSet set, const Schedule& schedule, const StopCheck& stop) {
         const double longest_s = 1.4 / (schedule.frame_time_s.back() / schedule.time_step_s);
         std::vector<Direction> along = still(cloth);
         start_at_rest_with_tangents(cloth, set, along, 9.81, 0, longest_s, stop);
         return set.start_position_m.allFinite();
       }},
  };
}

TEST(StopCheck, EndsEveryKindOfRunWithinOneFrameInterval) {
  const Cloth cloth = hung_cloth(6);
  const ParameterSet set = random_sets(cloth, 1, 1).front();
  // Some hundred questions, each after a thousandth of a second of work.
  const Schedule schedule = one_interval(20'000);
  for (const Kind& kind : kinds()) {
    SCOPED_TRACE(kind.name);
    std::atomic<int> asked = 0;
    EXPECT_TRUE(kind.run(cloth, set, schedule, [&] {
      ++asked;
      return false;
    }));
    EXPECT_GE(asked, 10);

    asked = 0;
    EXPECT_FALSE(kind.run(cloth, set, schedule, [&] { return ++asked >= 3; }));
    EXPECT_LE(asked, 4);  // each of two threads may ask once more
  }
}

TEST(StopCheck, LetsWhatItThrowsLeaveEveryKindOfRun) {
  const Cloth cloth = hung_cloth(6);
  const ParameterSet set = random_sets(cloth, 1, 1).front();
  for (const Kind& kind : kinds()) {
    SCOPED_TRACE(kind.name);
    EXPECT_THROW(kind.run(cloth, set, one_interval(20'000),
                          []() -> bool { throw std::runtime_error("enough"); }),
                 std::runtime_error);
  }
}

TEST(StopCheck, ChangesNoBitOfARunThatItLetsGoOn) {
  const Cloth cloth = hung_cloth(6);
  const ParameterSet set = random_sets(cloth, 1, 1).front();
  const Schedule schedule = one_interval(5'000);
  const auto end_of = [&](const StopCheck& stop) {
    return simulate(cloth, {&set, 1}, schedule, Precision::exact, {}, stop)
        .front()
        .position_m.back();
  };

  EXPECT_EQ(end_of({}), end_of([] { return false; }));
}

TEST(StopCheck, LeavesARunThatItEndsCancelledWithEveryFrame) {
  const Cloth cloth = hung_cloth(6);
  const ParameterSet set = random_sets(cloth, 1, 1).front();
  Schedule schedule = one_interval(20'000);
  schedule.frame_time_s.push_back(2 * schedule.frame_time_s.back());
  schedule.velocities = true;

  const SimulateResult run =
      simulate(cloth, {&set, 1}, schedule, Precision::exact, {}, [] { return true; }).front();

  EXPECT_EQ(run.reason, StopReason::cancelled);
  ASSERT_EQ(run.position_m.size(), 3u);
  EXPECT_EQ(run.velocity_m_per_s.size(), 3u);
  EXPECT_TRUE(run.position_m[0].allFinite());
  EXPECT_TRUE(run.position_m[1].array().isNaN().all());
}

TEST(StopCheck, IsAskedInAMeshOfOneStepPerQuestionToo) {
  // The finest mesh has more springs than a question waits for.
  int asked = 0;
  const StopCheck stop = [&] {
    ++asked;
    return false;
  };
  StopAsker asker(stop, 400'000);
  for (int step = 0; step < 5; ++step) EXPECT_FALSE(asker.ends());
  EXPECT_EQ(asked, 5);
}

}  // namespace
}  // namespace clothfit
