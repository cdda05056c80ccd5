// Runs over frames and the shape at rest. Not checked here: a single step (step_test.cpp), how long
// it may be (stability_test.cpp), and what is made of the positions (surface_test.cpp, tests/fit/).

#include "model/simulate.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>

#include "model/effects/registry.h"
#include "model/stability.h"
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

/// A cloth held by its two upper corners.
Cloth hung_cloth(int vertices_per_side) {
  Cloth cloth = square_cloth(vertices_per_side);
  cloth.held = {held_at(cloth.mesh, 0, 0), held_at(cloth.mesh, 0.4, 0)};
  return cloth;
}

std::vector<ParameterSet> random_sets(const Cloth& cloth, int count, unsigned seed) {
  Uniform uniform(seed);
  std::vector<ParameterSet> sets;
  for (int n = 0; n < count; ++n) {
    sets.push_back({.springs = spring_parameters(random_fabric(uniform), cloth.mesh),
                    .effects = {{uniform(0, 2)}},
                    .start_position_m = crumpled(cloth.mesh, 0.1, uniform)});
  }
  return sets;
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
  cloth.add_effect("viscous_damping", "test");
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
  cloth.add_effect("viscous_damping", "test");
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
  cloth.add_effect("viscous_damping", "test");
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

  // Within an interval cut into n steps h: z falls by n h v + h^2 g n (n + 1) / 2, v by n h g.
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
  // A cloth of 0.4 m counts as lost beyond a hundred diagonals, 56.57 m; free fall takes it there
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

// --- the shape at rest ---------------------------------------------------------------------------

TEST(Relax, AHangingChainStretchesByTheWeightBelowEachSpring) {
  // Given a strip of two columns held by its upper two vertices, structural springs only,
  const Mesh mesh{.columns = 2, .rows = 9, .width_m = 0.05, .height_m = 0.4};
  Cloth cloth = Cloth::of(mesh, masses_by_area(mesh, 0.02));
  cloth.held = {held_at(mesh, 0, 0), held_at(mesh, 0.05, 0)};
  ParameterSet set{.start_position_m = hung_flat(mesh)};
  const double k = 15;
  set.springs.natural_length_m = flat_lengths(mesh);
  set.springs.stiffness_n_per_m[structural_t] = k;
  set.springs.stiffness_n_per_m[structural_s] = k;
  set.springs.damping_ns_per_m[structural_t] = 0.02;

  // when it is relaxed,
  const Eigen::Matrix3Xd p =
      relax(cloth, {&set, 1}, 9.81, 0, 0.5 * stable_time_step_s(cloth, set)).front().position_m;

  // then each spring carries what hangs below it: l - l0 = weight / k.
  for (int j = 0; j < 2; ++j) {
    double weight_n = 0;
    for (int i = mesh.rows - 1; i > 0; --i) {
      weight_n += 9.81 * cloth.mass_kg[mesh.vertex(i, j)];
      const double length_m = (p.col(mesh.vertex(i, j)) - p.col(mesh.vertex(i - 1, j))).norm();
      EXPECT_NEAR((length_m - 0.05) * k, weight_n, 0.01 * weight_n) << i << ", " << j;
    }
  }
  EXPECT_LT(p.row(1).cwiseAbs().maxCoeff(), 1e-12);
}

/// Largest force that is left on a free vertex, over the cloth's weight.
double residual_force(const Cloth& cloth, const ParameterSet& set, const Eigen::Matrix3Xd& p) {
  Eigen::Matrix3Xd force_n = spring_forces_n(cloth.mesh, set.springs, p, at_rest(p));
  force_n += set.gravity_m_per_s2 * cloth.mass_kg.transpose();
  for (const HeldVertexWeights& held : cloth.held)
    for (const auto& [vertex, weight] : held.weights) force_n.col(vertex).setZero();
  return force_n.colwise().norm().maxCoeff() / (9.81 * cloth.mass_kg.sum());
}

TEST(Relax, BalancesTheForcesOfAClothHungByTwoCorners) {
  const Cloth cloth = hung_cloth(9);
  ParameterSet set{.springs = spring_parameters(cotton(), cloth.mesh),
                   .start_position_m = hung_flat(cloth.mesh)};
  // Corners closer together than the cloth is wide, so that it sags and folds.
  Cloth sagging = cloth;
  sagging.held[1].motion = [](double) { return Eigen::Vector3d(0.36, 0, 0); };

  for (const Cloth* hung : {&cloth, static_cast<const Cloth*>(&sagging)}) {
    SCOPED_TRACE(hung == &cloth ? "straight" : "sagging");
    const double h = 0.5 * stable_time_step_s(*hung, set);
    const Eigen::Matrix3Xd p = relax(*hung, {&set, 1}, 9.81, 0, h).front().position_m;

    EXPECT_LT(residual_force(*hung, set, p), 0.01);
    EXPECT_GT(residual_force(*hung, set, set.start_position_m), 0.01);
    EXPECT_LT((p.col(0) - Eigen::Vector3d(0, 0, 0)).norm(), 1e-15);
  }
}

TEST(Relax, PutsMovingHeldPointsWhereTheyAreAtThatTime) {
  Cloth cloth = hung_cloth(5);
  cloth.held[1].motion = [](double time_s) { return Eigen::Vector3d(0.3 + 0.1 * time_s, 0, 0); };
  const ParameterSet set{.springs = spring_parameters(cotton(), cloth.mesh),
                         .start_position_m = hung_flat(cloth.mesh)};

  const Eigen::Matrix3Xd p =
      relax(cloth, {&set, 1}, 9.81, 0.5, 0.5 * stable_time_step_s(cloth, set)).front().position_m;

  EXPECT_LT((p.col(4) - Eigen::Vector3d(0.35, 0, 0)).norm(), 1e-15);
}

TEST(Relax, IsSmoothInTheParameters) {
  const Cloth cloth = hung_cloth(6);
  const double h = 1e-3;
  // Shapes for the stiffness of one type scaled by 1 + step and 1 - step; the derivative between.
  const auto derivative = [&](size_t type, double step) {
    std::vector<ParameterSet> sets;
    for (const double sign : {1.0, -1.0}) {
      sets.push_back({.springs = spring_parameters(cotton(), cloth.mesh),
                      .start_position_m = hung_flat(cloth.mesh)});
      sets.back().springs.stiffness_n_per_m[type] *= 1 + sign * step;
    }
    const auto shapes = relax(cloth, sets, 9.81, 0, h);
    return Eigen::Matrix3Xd((shapes[0].position_m - shapes[1].position_m) / (2 * step));
  };

  for (const size_t type : {structural_t, structural_s, shear_down, flexion_t}) {
    SCOPED_TRACE(type);
    const Eigen::Matrix3Xd wide = derivative(type, 1e-2), narrow = derivative(type, 1e-4);

    EXPECT_GT(narrow.norm(), 1e-6);  // metres per unit of the logarithm
    EXPECT_LT((wide - narrow).norm(), 0.01 * narrow.norm());
  }
}

TEST(Relax, DependsNeitherOnTheNumberOfSetsNorOnTheirOrder) {
  const Cloth cloth = hung_cloth(5);
  std::vector<ParameterSet> sets = random_sets(cloth, kLanes + 2, 5);
  for (ParameterSet& set : sets) set.effects.clear();
  const std::vector<ParameterSet> backwards(sets.rbegin(), sets.rend());

  const auto shapes = relax(cloth, sets, 9.81, 0, 2e-4);
  const auto reversed = relax(cloth, backwards, 9.81, 0, 2e-4);

  for (size_t n = 0; n < sets.size(); ++n) {
    EXPECT_EQ(shapes[n].position_m, reversed[sets.size() - 1 - n].position_m) << n;
    EXPECT_EQ(shapes[n].position_m, relax(cloth, {&sets[n], 1}, 9.81, 0, 2e-4).front().position_m)
        << n;
  }
}

/// A sheet that hangs flat from its upper edge, with effects on it.
struct Curtain {
  Cloth cloth = square_cloth(7);
  ParameterSet set{.springs = spring_parameters(cotton(), cloth.mesh),
                   .start_position_m = hung_flat(cloth.mesh)};

  explicit Curtain(const std::vector<std::pair<std::string, std::vector<double>>>& effects) {
    for (int j = 0; j < 7; ++j) cloth.held.push_back(held_at(cloth.mesh, 0.4 * j / 6, 0));
    for (const auto& [name, parameters] : effects) {
      cloth.add_effect(name, "test");
      set.effects.push_back(parameters);
    }
  }
  double time_step_s() const { return 0.5 * stable_time_step_s(cloth, set); }
  ParameterSet at_rest() const {
    ParameterSet start = set;
    start_at_rest(cloth, {&start, 1}, 9.81, 0, time_step_s());
    return start;
  }
  /// How far any vertex comes from where it starts within half a second.
  double way_m(const ParameterSet& start) const {
    const SimulateResult run = simulate(cloth, {&start, 1}, frames(31, 60, time_step_s())).front();
    double furthest_m = 0;
    for (const Eigen::Matrix3Xd& p : run.position_m)
      furthest_m = std::max(furthest_m, (p - start.start_position_m).colwise().norm().maxCoeff());
    return furthest_m;
  }
};

TEST(StartAtRest, AClothWhoseFabricRemembersStaysWhereItIs) {
  const double ratio = 0.7, yield = 5e-3, time_s = 0.1;
  for (const Curtain& curtain :
       {Curtain({{"hysteresis", {ratio, yield}}}), Curtain({{"relaxation", {ratio, time_s}}})}) {
    SCOPED_TRACE(curtain.cloth.effect_descriptions.front().name);
    ParameterSet start = curtain.at_rest();

    // Relaxing takes 1.4 s, in which a stress that halves in 0.07 s falls a millionfold; it began
    // as some millimetres of stretch.
    EXPECT_LT(curtain.way_m(start), 1e-6);
    start.start_effect_memory.clear();
    EXPECT_GT(curtain.way_m(start), 1e-4);
  }
}

TEST(StartAtRest, HandsEveryEffectItsOwnMemory) {
  const std::vector<double> wind{0.01, 0.1, 0.2, 0}, relaxation{0.7, 0.1};
  const size_t slip_parameters = find_effect("support_slip", "test").describe().parameters.size();
  const Curtain alone({{"wind", wind}, {"relaxation", relaxation}});
  const Curtain among({{"wind", wind},
                       {"support_slip", std::vector<double>(slip_parameters, 0.01)},
                       {"relaxation", relaxation}});
  ParameterSet one = alone.set, still = among.set;
  still.start_velocity_m_per_s.setZero(3, among.cloth.mesh.vertex_count());

  start_at_rest(alone.cloth, {&one, 1}, 9.81, 0, among.time_step_s());
  start_at_rest(among.cloth, {&still, 1}, 9.81, 0, among.time_step_s());

  ASSERT_EQ(still.start_effect_memory.size(), 3u);
  EXPECT_EQ(still.start_position_m, one.start_position_m);
  EXPECT_EQ(still.start_effect_memory[0].size(), 0);
  EXPECT_EQ(still.start_effect_memory[1],
            Eigen::VectorXd::Zero(among.cloth.effects[1]->memory_size(among.cloth)));
  EXPECT_EQ(still.start_effect_memory[2], one.start_effect_memory[1]);
  EXPECT_GT(one.start_effect_memory[1].norm(), 0.01);
  EXPECT_EQ(still.start_velocity_m_per_s.cols(), 0);
}

TEST(StartAtRest, DependsNeitherOnTheOtherSetsNorOnTheThreads) {
  const Curtain curtain({{"hysteresis", {0.7, 5e-3}}});
  std::vector<ParameterSet> sets(kLanes + 2, curtain.set);
  for (size_t n = 0; n < sets.size(); ++n)
    sets[n].springs.stiffness_n_per_m[structural_t] *= 1 + 0.01 * static_cast<double>(n);
  std::vector<ParameterSet> backwards(sets.rbegin(), sets.rend());

  start_at_rest(curtain.cloth, sets, 9.81, 0, 5e-4);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  start_at_rest(curtain.cloth, backwards, 9.81, 0, 5e-4);

  for (size_t n = 0; n < sets.size(); ++n) {
    const ParameterSet& other = backwards[sets.size() - 1 - n];
    EXPECT_EQ(sets[n].start_position_m, other.start_position_m) << n;
    EXPECT_EQ(sets[n].start_effect_memory, other.start_effect_memory) << n;
  }
}

TEST(StartAtRest, DoesNotDependOnWhereTheGravityOfOthersPoints) {
  // Turned vectors of one length differ in it by rounding.
  Curtain curtain({});
  std::vector<ParameterSet> sets(kLanes + 2, curtain.set);
  std::vector<ParameterSet> alone = sets;
  for (size_t n = 0; n < sets.size(); ++n) {
    const Eigen::AngleAxisd turn(0.01 * static_cast<double>(n), Eigen::Vector3d(0.6, 0.8, 0));
    alone[n].gravity_m_per_s2 = sets[n].gravity_m_per_s2 = turn * Eigen::Vector3d(0, 0, -9.81);
  }

  start_at_rest(curtain.cloth, sets, 9.81, 0, 5e-4);

  for (size_t n = 0; n < sets.size(); ++n) {
    start_at_rest(curtain.cloth, {&alone[n], 1}, 9.81, 0, 5e-4);
    EXPECT_EQ(sets[n].start_position_m, alone[n].start_position_m) << n;
  }
}

TEST(Simulate, LetsEverySetStartFromItsOwnMemory) {
  const unsigned seed = 31;
  SCOPED_TRACE(seed);
  Uniform uniform(seed);
  const Curtain curtain({{"hysteresis", {0.7, 5e-3}}, {"relaxation", {0.7, 0.1}}});
  for (const Precision precision : {Precision::exact, Precision::fast}) {
    SCOPED_TRACE(static_cast<int>(precision));
    // Enough to fill lanes, and one more, which goes alone.
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
