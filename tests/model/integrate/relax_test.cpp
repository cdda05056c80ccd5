// Checks shapes at rest. Not checked here: runs over frames (simulate_test.cpp), and the exact
// minimum of the energy (equilibrium/).

#include "model/integrate/relax.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>

#include "model/cloth/stability.h"
#include "model/effects/registry.h"
#include "model/integrate/simulate.h"
#include "tests/model/curtain.h"
#include "tests/model/hung_cloth.h"
#include "tests/model/mechanics.h"
#include "tests/model/random_cloth.h"
#include "tests/model/swing.h"

namespace clothfit {
namespace {

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

/// Returns the largest force that remains on a free vertex, over the cloth's weight.
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
  // Corners are closer together than the cloth is wide, so that it sags and folds.
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
  // Shapes are for the stiffness of one type scaled by 1 + step and 1 - step; the derivative lies
  // between.
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

TEST(StartAtRest, AClothWhoseFabricRemembersStaysWhereItIs) {
  const double ratio = 0.7, yield = 5e-3, time_s = 0.1;
  for (const Curtain& curtain :
       {Curtain({{"hysteresis", {ratio, yield}}}), Curtain({{"relaxation", {ratio, time_s}}})}) {
    SCOPED_TRACE(curtain.cloth.effect_descriptions.front().name);
    ParameterSet start = curtain.at_rest();

    // Relaxing takes 1.4 s, in which a stress that halves in 0.07 s falls a millionfold. It began
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

TEST(StartAtRest, HasTangentsThatAgreeWithCentralDifferences) {
  for (const unsigned seed : {1u, 2u}) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    // Given a cloth with a moved point, drag, and a fabric that remembers,
    Uniform uniform(seed);
    Swing swing(uniform);
    for (const char* name : {"viscous_damping", "relaxation"}) {
      add_effect(swing.cloth, name, "test");
      swing.set.effects.push_back(
          effect_contract::random_parameters(swing.cloth.effect_descriptions.back(), uniform));
    }
    constexpr double kStep = 5e-4;
    std::vector<Direction> directions;
    for (int d = 0; d < kLanes + 2; ++d)
      directions.push_back(random_direction(swing.cloth, uniform));
    for (Direction& direction : directions) direction.held_motion.clear();
    const Direction asked = directions.back();

    // when it is brought to rest with its derivatives,
    ParameterSet at_rest = swing.set;
    start_at_rest_with_tangents(swing.cloth, at_rest, directions, 9.81, 0.02, kStep);

    // then it is where it is without them, and they agree with differences.
    ParameterSet alone = swing.set;
    start_at_rest(swing.cloth, {&alone, 1}, 9.81, 0.02, kStep);
    EXPECT_EQ(at_rest.start_position_m, alone.start_position_m);
    EXPECT_EQ(at_rest.start_effect_memory, alone.start_effect_memory);
    constexpr double kBy = 1e-6;
    std::array<ParameterSet, 2> moved{swing.set, swing.set};
    for (const int side : {0, 1}) {
      ParameterSet& set = moved[static_cast<size_t>(side)];
      const double by = side == 0 ? kBy : -kBy;
      for (size_t type = 0; type < kSpringTypes; ++type) {
        set.springs.natural_length_m[type] += by * asked.natural_length_m[type];
        set.springs.stiffness_n_per_m[type] += by * asked.stiffness_n_per_m[type];
        set.springs.damping_ns_per_m[type] += by * asked.damping_ns_per_m[type];
      }
      set.gravity_m_per_s2 += by * asked.gravity_m_per_s2;
      for (size_t e = 0; e < set.effects.size(); ++e)
        for (size_t p = 0; p < set.effects[e].size(); ++p)
          set.effects[e][p] += by * asked.effects[e][p];
      set.start_position_m += by * asked.start_position_m;
    }
    start_at_rest(swing.cloth, moved, 9.81, 0.02, kStep);
    const Eigen::Matrix3Xd difference =
        (moved[0].start_position_m - moved[1].start_position_m) / (2 * kBy);
    const Eigen::Matrix3Xd& tangent = directions.back().start_position_m;
    EXPECT_LT((tangent - difference).norm(), 1e-5 * tangent.norm());  // the rest is curvature
    const Eigen::VectorXd remembered =
        (moved[0].start_effect_memory[1] - moved[1].start_effect_memory[1]) / (2 * kBy);
    EXPECT_LT((directions.back().start_effect_memory[1] - remembered).norm(),
              1e-5 * remembered.norm());
    EXPECT_GT(remembered.norm(), 0);
  }
}

// An effect that the cloth does not have yet remembers the same as one that it has at its neutral
// values. A run goes on from that.
TEST(StartAtRest, HandsOnWhatEmergingEffectsRemember) {
  constexpr double kStep = 5e-4;
  for (const char* name : {"relaxation", "hysteresis"}) {
    SCOPED_TRACE(name);
    Uniform uniform(3);
    const Swing swing(uniform);
    TwoWays ways(swing.cloth, swing.set, {name, "ratio"});
    ParameterSet without = swing.set, with = ways.set;
    std::vector<Direction> emerging{ways.emerging}, present{ways.present};

    start_at_rest_with_tangents(swing.cloth, without, emerging, 9.81, 0, kStep);
    start_at_rest_with_tangents(ways.cloth, with, present, 9.81, 0, kStep);

    EXPECT_EQ(without.start_position_m, with.start_position_m);
    ASSERT_TRUE(emerging.front().emerging);
    EXPECT_EQ(emerging.front().emerging->start_memory, with.start_effect_memory.front());
    EXPECT_GT(with.start_effect_memory.front().norm(), 1e-3);
    const Eigen::Matrix3Xd& start = present.front().start_position_m;
    EXPECT_LT((emerging.front().start_position_m - start).norm(), 1e-4 * start.norm());
    const TangentResult found =
        simulate_with_tangents(swing.cloth, without, emerging, swing.schedule);
    const TangentResult expected =
        simulate_with_tangents(ways.cloth, with, present, swing.schedule);
    for (size_t f = 1; f < swing.schedule.frame_time_s.size(); ++f) {
      const Eigen::Matrix3Xd& tangent = expected.position_tangent[0][f];
      EXPECT_LT((found.position_tangent[0][f] - tangent).norm(), 1e-4 * tangent.norm()) << f;
      EXPECT_GT(tangent.norm(), 0);
    }
    // With nothing remembered it would start as a stress that has not relaxed.
    emerging.front().emerging->start_memory.resize(0);
    const Eigen::Matrix3Xd forgetful =
        simulate_with_tangents(swing.cloth, without, emerging, swing.schedule)
            .position_tangent[0]
            .back();
    const Eigen::Matrix3Xd& last = expected.position_tangent[0].back();
    EXPECT_GT((forgetful - last).norm(), 0.01 * last.norm());
  }
}

}  // namespace
}  // namespace clothfit
