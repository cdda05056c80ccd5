// Checks runs over frames. Not checked here: a single step (step_test.cpp), how long it may be
// (stability_test.cpp), shapes at rest (relax_test.cpp), and the use of the positions
// (surface_test.cpp, tests/fit/).

#include "model/integrate/simulate.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>

#include "model/cloth/stability.h"
#include "model/effects/registry.h"
#include "tests/model/curtain.h"
#include "tests/model/hung_cloth.h"
#include "tests/model/mechanics.h"
#include "tests/model/random_cloth.h"
#include "tests/model/scalar_reference.h"

namespace clothfit {
namespace {

Schedule frames(int count, double rate_hz, double time_step_s) {
  Schedule schedule{.time_step_s = time_step_s};
  for (int n = 0; n < count; ++n) schedule.frame_time_s.push_back(n / rate_hz);
  return schedule;
}

bool same_bits(const SimulateResult& a, const SimulateResult& b) {
  if (a.reason != b.reason || a.diverged_frame != b.diverged_frame) return false;
  if (a.position_m.size() != b.position_m.size()) return false;
  for (size_t f = 0; f < a.position_m.size(); ++f) {
    const bool lost = a.reason == StopReason::diverged && static_cast<int>(f) >= a.diverged_frame;
    if (lost ? !b.position_m[f].array().isNaN().all() : a.position_m[f] != b.position_m[f])
      return false;
  }
  return true;
}

// --- one result, however it is computed ----------------------------------------------------------

TEST(Simulate, DependsNeitherOnTheNumberOfSetsNorOnTheirOrder) {
  Cloth cloth = hung_cloth(6);
  add_effect(cloth, "viscous_damping", "test");
  const std::vector<ParameterSet> sets = random_sets(cloth, 2 * kLanes + 3, 1);
  const std::vector<ParameterSet> backwards(sets.rbegin(), sets.rend());
  const Schedule schedule = frames(6, 30, 2e-4);

  const auto together = simulate(cloth, sets, schedule);
  const auto reversed = simulate(cloth, backwards, schedule);

  ASSERT_EQ(together.size(), sets.size());
  for (size_t n = 0; n < sets.size(); ++n) {
    SCOPED_TRACE(n);
    ASSERT_TRUE(together[n].usable());
    ASSERT_EQ(together[n].position_m.size(), 6u);
    EXPECT_TRUE(same_bits(together[n], simulate(cloth, {&sets[n], 1}, schedule).front()));
    EXPECT_TRUE(same_bits(together[n], reversed[sets.size() - 1 - n]));
    EXPECT_GT((together[n].position_m.back() - sets[n].start_position_m).norm(), 0.1);
  }
}

TEST(Simulate, DoesNotDependOnTheNumberOfThreads) {
  Cloth cloth = hung_cloth(6);
  add_effect(cloth, "viscous_damping", "test");
  const std::vector<ParameterSet> sets = random_sets(cloth, 5 * kLanes, 2);
  const Schedule schedule = frames(4, 30, 2e-4);
  const auto on_threads = [&](size_t count) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, count);
    return simulate(cloth, sets, schedule);
  };

  const auto one = on_threads(1), many = on_threads(8);

  for (size_t n = 0; n < sets.size(); ++n) EXPECT_TRUE(same_bits(one[n], many[n])) << n;
}

TEST(Simulate, AgreesWithTheScalarReferenceToTheLastBit) {
  Cloth cloth = square_cloth(7);
  add_effect(cloth, "viscous_damping", "test");
  const std::vector<ParameterSet> sets = random_sets(cloth, kLanes + 1, 3);
  const double h = 1.0 / 4096;  // frame intervals of a power of two are cut without rounding
  const Schedule schedule{.frame_time_s = {0, 64 * h, 256 * h}, .time_step_s = h};

  const auto results = simulate(cloth, sets, schedule);

  for (size_t n = 0; n < sets.size(); ++n) {
    SCOPED_TRACE(n);
    const double rate_per_s = sets[n].effects[0][0];
    EXPECT_EQ(results[n].position_m[0], sets[n].start_position_m);
    EXPECT_EQ(results[n].position_m[1], reference_fall(cloth, sets[n], rate_per_s, h, 64));
    EXPECT_EQ(results[n].position_m[2], reference_fall(cloth, sets[n], rate_per_s, h, 256));
  }
}

TEST(Simulate, OfNoSetsIsNothing) {
  EXPECT_TRUE(simulate(square_cloth(3), {}, frames(3, 30, 1e-3)).empty());
}

// --- time ----------------------------------------------------------------------------------------

TEST(Schedule, CutsEachIntervalIntoTheFewestEqualSteps) {
  // 0.03 / 0.01 is a rounding above 3: that must not cost a fourth step.
  const Schedule schedule{.frame_time_s = {0, 0.03, 0.0301, 0.0651, 1.0651}, .time_step_s = 0.01};

  EXPECT_EQ(schedule.substeps(1), 3);
  EXPECT_EQ(schedule.substeps(2), 1);
  EXPECT_EQ(schedule.substeps(3), 4);
  EXPECT_EQ(schedule.substeps(4), 100);
}

TEST(Simulate, FallsFreelyThroughIrregularFrames) {
  const Cloth cloth = square_cloth(4);
  const ParameterSet set{.springs = spring_parameters(cotton(), cloth.mesh),
                         .start_position_m = flat_positions(cloth.mesh)};
  const Schedule schedule{.frame_time_s = {2.0, 2.013, 2.05, 2.0501, 2.2}, .time_step_s = 1e-3};

  const SimulateResult result = simulate(cloth, {&set, 1}, schedule).front();

  // Within an interval cut into n steps h, z falls by n h v + h^2 g n (n + 1) / 2, v by n h g.
  double z = 0, v = 0;
  for (int f = 1; f < 5; ++f) {
    const auto at = static_cast<size_t>(f);
    const double interval_s = schedule.frame_time_s[at] - schedule.frame_time_s[at - 1];
    const int n = static_cast<int>(std::ceil(interval_s / 1e-3 - 1e-9));
    const double h = interval_s / n;
    z += n * h * v - 9.81 * h * h * n * (n + 1) / 2;
    v -= 9.81 * n * h;
    EXPECT_NEAR(result.position_m[at](2, 7), z, 1e-12) << f;
  }
}

TEST(Simulate, HeldPointsAreWhereTheirMotionHasThemAtEveryFrame) {
  Cloth cloth = hung_cloth(5);
  const auto motion = [](double time_s) {
    return Eigen::Vector3d(0.02 * std::sin(9 * time_s), 0.1 * time_s, -0.01 * time_s);
  };
  cloth.held[0].motion = motion;
  cloth.held.push_back(held_at(cloth.mesh, 0.23, 0.31));
  const ParameterSet set{.springs = spring_parameters(cotton(), cloth.mesh),
                         .start_position_m = flat_positions(cloth.mesh)};
  const Schedule schedule{.frame_time_s = {0, 0.013, 0.05, 0.0501, 0.2}, .time_step_s = 2e-4};

  const SimulateResult result = simulate(cloth, {&set, 1}, schedule).front();

  for (size_t f = 1; f < 5; ++f) {
    SCOPED_TRACE(f);
    const LaneVectors<> at = HeldPlacement<>(cloth).locate(every_lane(result.position_m[f]));
    EXPECT_LT((at.lane(0).col(0) - motion(schedule.frame_time_s[f])).norm(), 1e-14);
    EXPECT_LT((at.lane(0).col(1) - Eigen::Vector3d(0.4, 0, 0)).norm(), 1e-15);
    EXPECT_LT((at.lane(0).col(2) - Eigen::Vector3d(0.23, 0.31, 0)).norm(), 1e-15);
  }
}

// --- divergence ----------------------------------------------------------------------------------

TEST(Simulate, ReportsWhatDivergesAndLeavesItsNeighboursAlone) {
  // Given eight sets in one group of lanes, one a thousand times too stiff for the step,
  const Cloth cloth = hung_cloth(6);
  std::vector<ParameterSet> sets = random_sets(cloth, kLanes, 4);
  for (ParameterSet& set : sets) set.effects.clear();
  std::vector<ParameterSet> mixed = sets;
  for (double& k : mixed[5].springs.stiffness_n_per_m) k *= 1000;
  const Schedule schedule = frames(8, 30, 2e-4);
  ASSERT_GT(2e-4, 2 * stable_time_step_s(cloth, mixed[5]));

  // when they run,
  const auto calm = simulate(cloth, sets, schedule);
  const auto results = simulate(cloth, mixed, schedule);

  // then that one says so and leaves no number behind, and the others have not noticed.
  EXPECT_EQ(results[5].reason, StopReason::diverged);
  EXPECT_FALSE(results[5].usable());
  EXPECT_EQ(results[5].diverged_frame, 1);
  ASSERT_EQ(results[5].position_m.size(), 8u);
  EXPECT_EQ(results[5].position_m[0], mixed[5].start_position_m);
  for (size_t f = 1; f < 8; ++f) EXPECT_TRUE(results[5].position_m[f].array().isNaN().all());
  for (size_t n = 0; n < sets.size(); ++n) {
    if (n == 5) continue;
    EXPECT_TRUE(same_bits(results[n], calm[n])) << n;
  }
}

TEST(Simulate, NamesTheFirstFrameThatLeftTheScene) {
  // A cloth of 0.4 m counts as lost beyond a hundred diagonals, 56.57 m. Free fall takes it there
  // after 3.40 s.
  const Cloth cloth = square_cloth(3);
  const ParameterSet set{.springs = spring_parameters(cotton(), cloth.mesh),
                         .start_position_m = flat_positions(cloth.mesh)};

  const SimulateResult result = simulate(cloth, {&set, 1}, frames(50, 10, 1e-3)).front();

  EXPECT_EQ(result.reason, StopReason::diverged);
  EXPECT_EQ(result.diverged_frame, 34);
  EXPECT_TRUE(result.position_m[33].allFinite());
  ASSERT_EQ(result.position_m.size(), 50u);
  for (size_t f = 34; f < 50; ++f) EXPECT_TRUE(result.position_m[f].array().isNaN().all());
}

TEST(Simulate, LetsEverySetStartFromItsOwnMemory) {
  const unsigned seed = 31;
  SCOPED_TRACE(seed);
  Uniform uniform(seed);
  const Curtain curtain({{"hysteresis", {0.7, 5e-3}}, {"relaxation", {0.7, 0.1}}});
  for (const Precision precision : {Precision::exact, Precision::fast}) {
    SCOPED_TRACE(static_cast<int>(precision));
    // The sets fill lanes, and one more goes alone.
    std::vector<ParameterSet> sets(
        (precision == Precision::exact ? ExactLanes::kCount : FastLanes::kCount) + 1, curtain.set);
    for (ParameterSet& set : sets)
      for (const std::shared_ptr<const Effect>& effect : curtain.cloth.effects) {
        set.start_effect_memory.emplace_back(effect->memory_size(curtain.cloth));
        for (double& number : set.start_effect_memory.back()) number = uniform(-5e-3, 5e-3);
      }
    const Schedule schedule = frames(4, 60, curtain.time_step_s());

    const std::vector<SimulateResult> together = simulate(curtain.cloth, sets, schedule, precision);

    for (size_t n = 0; n < sets.size(); ++n) {
      SCOPED_TRACE(n);
      const SimulateResult alone = simulate(curtain.cloth, {&sets[n], 1}, schedule).front();
      const double apart_m =
          (together[n].position_m[3] - alone.position_m[3]).cwiseAbs().maxCoeff();
      const double moved_m = (alone.position_m[3] - together[(n + 1) % sets.size()].position_m[3])
                                 .cwiseAbs()
                                 .maxCoeff();
      EXPECT_GT(moved_m, 1e-4);  // memories matter
      EXPECT_LE(apart_m, precision == Precision::exact ? 0 : 1e-6);
    }
  }
}

TEST(Simulate, SaysHowWellTheStrainLimitWasKept) {
  // Given corners that are held 12.5 % further apart than the cloth is wide, springs limited to 10
  // %,
  Cloth cloth = square_cloth(5);
  cloth.held = {held_at(cloth.mesh, 0, 0), held_at(cloth.mesh, 0.4, 0)};
  ParameterSet set{.springs = spring_parameters(cotton(), cloth.mesh),
                   .start_position_m = hung_flat(cloth.mesh)};
  set.start_position_m.row(0) *= 1.125;
  set.springs.critical_elongation.fill(0.1);
  const Schedule schedule{.frame_time_s = {0, 0.01, 0.02}, .time_step_s = 1e-3};
  const auto kept = [&](StrainLimitMode mode) {
    cloth.strain_limit.mode = mode;
    return simulate(cloth, {&set, 1}, schedule).front();
  };

  const SimulateResult free = kept(StrainLimitMode::off);
  const SimulateResult consistent = kept(StrainLimitMode::consistent);
  EXPECT_EQ(free.largest_excess, 0);
  EXPECT_EQ(free.unmet_steps, 0);
  EXPECT_EQ(consistent.unmet_steps, 20);
  EXPECT_GT(consistent.largest_excess, 0.02);

  set.start_position_m = hung_flat(cloth.mesh);  // within reach
  EXPECT_EQ(kept(StrainLimitMode::consistent).unmet_steps, 0);
  EXPECT_LE(kept(StrainLimitMode::consistent).largest_excess, 1e-3 + 1e-12);
}

TEST(Simulate, EndsEarlyWhereItIsAskedTo) {
  const Cloth cloth = square_cloth(4);
  const ParameterSet set{.springs = spring_parameters(cotton(), cloth.mesh),
                         .start_position_m = flat_positions(cloth.mesh)};
  const Schedule schedule{.frame_time_s = {0, 0.01, 0.02, 0.03}, .time_step_s = 1e-3};
  std::vector<int> seen;

  const SimulateResult result =
      simulate(cloth, {&set, 1}, schedule, Precision::exact, [&](int frame) {
        seen.push_back(frame);
        return frame < 2;
      }).front();

  EXPECT_EQ(result.reason, StopReason::cancelled);
  EXPECT_EQ(seen, (std::vector<int>{0, 1, 2}));
  ASSERT_EQ(result.position_m.size(), 4u);
  EXPECT_TRUE(result.position_m[2].allFinite());
  EXPECT_TRUE(result.position_m[3].array().isNaN().all());
}

TEST(Simulate, OfLeftOverSetsGivesWhatEachGivesAlone) {
  // 8 lanes hold 8 sets; of 11, 13 or 3 some are left over and run alone or in a group not full.
  Uniform uniform(12);
  const Cloth cloth = square_cloth(4);
  const Schedule schedule{.frame_time_s = {0, 0.02}, .time_step_s = 1e-3};
  std::vector<ParameterSet> sets;
  for (int n = 0; n < 13; ++n)
    sets.push_back({.springs = spring_parameters(random_fabric(uniform), cloth.mesh),
                    .start_position_m = crumpled(cloth.mesh, 0.2, uniform)});

  for (const size_t count : {size_t{3}, size_t{11}, size_t{13}}) {
    SCOPED_TRACE(count);
    const std::vector<SimulateResult> together = simulate(cloth, {sets.data(), count}, schedule);
    ASSERT_EQ(together.size(), count);
    for (size_t n = 0; n < count; ++n)
      EXPECT_EQ(together[n].position_m, simulate(cloth, {&sets[n], 1}, schedule)[0].position_m);
  }
}

}  // namespace
}  // namespace clothfit
