// Checks one model in three kinds of numbers: `exact` lanes, a single simulation, `fast` lanes. Not
// checked here: that the exact ones are right (cloth_sweep_test.cpp, strain_limit_test.cpp).

#include "model/kernels/lanes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "tests/model/instruction_sets.h"
#include "tests/model/mechanics.h"
#include "tests/model/random_cloth.h"

namespace clothfit {
namespace {

/// A soft cloth of `rows` x `columns`, hung by two corners and crumpled. Its springs may stretch by
/// a twentieth.
struct Hung {
  Cloth cloth;
  ParameterSet set;
  Eigen::Matrix3Xd velocity_m_per_s;

  Hung(int rows, int columns, StrainLimitMode mode, Uniform& uniform) {
    const Mesh mesh{.columns = columns, .rows = rows, .width_m = 0.4, .height_m = 0.4};
    cloth = Cloth::of(mesh, masses_by_area(mesh, 0.025));
    cloth.held = {held_at(mesh, 0, 0), held_at(mesh, 0.4, 0)};
    cloth.strain_limit = {.mode = mode, .most_sweeps = 5};
    set.springs = spring_parameters(random_fabric(uniform), mesh);
    set.start_position_m = crumpled(mesh, 0.3, uniform);
    set.springs.critical_elongation.fill(0.05);
    velocity_m_per_s = uniform.vectors(mesh.vertex_count(), 1);
  }
};

class SingleLaneOn : public testing::TestWithParam<InstructionSet> {};

TEST_P(SingleLaneOn, GivesTheBitsOfExactLanes) {
  const unsigned seed = 21;
  SCOPED_TRACE(seed);
  const OnInstructionSet on(GetParam());
  Uniform uniform(seed);
  const std::pair<int, int> sizes[] = {{2, 2},  {2, 3},  {3, 2}, {3, 3},  {4, 5},
                                       {5, 19}, {33, 7}, {6, 9}, {17, 17}};
  for (const auto& [rows, columns] : sizes) {
    for (const StrainLimitMode mode : {StrainLimitMode::off, StrainLimitMode::positions,
                                       StrainLimitMode::rates_first, StrainLimitMode::consistent}) {
      SCOPED_TRACE(testing::Message()
                   << rows << " x " << columns << ", mode " << static_cast<int>(mode));
      const Hung hung(rows, columns, mode, uniform);
      SteppedCloth<SingleLane> single(hung.cloth, hung.set, hung.velocity_m_per_s);
      SteppedCloth<ExactLanes> lanes(hung.cloth, hung.set, hung.velocity_m_per_s);

      double too_long = 0;
      for (int n = 0; n < 50; ++n) {
        single.step(5e-5);
        lanes.step(5e-5);
        EXPECT_EQ(single.limit_outcome().too_long[0], lanes.limit_outcome().too_long[0]);
        EXPECT_EQ(single.limit_outcome().unmet[0], lanes.limit_outcome().unmet[0]);
        too_long += single.limit_outcome().too_long[0];
      }

      EXPECT_EQ(single.position_m(), lanes.position_m());
      EXPECT_EQ(single.velocity_m_per_s(), lanes.velocity_m_per_s());
      if (mode != StrainLimitMode::off) {
        EXPECT_GT(too_long, 0);
      }
      EXPECT_GT((single.position_m() - hung.set.start_position_m).cwiseAbs().maxCoeff(), 1e-4);
    }
  }
}

TEST_P(SingleLaneOn, TakesSpringsThatDifferAsLanesDo) {
  const unsigned seed = 22;
  SCOPED_TRACE(seed);
  const OnInstructionSet on(GetParam());
  Uniform uniform(seed);
  for (const auto& [rows, columns] : {std::pair{5, 19}, std::pair{33, 7}}) {
    SCOPED_TRACE(columns);
    // Given factors of their own for the springs,
    const Hung hung(rows, columns, StrainLimitMode::off, uniform);
    const Mesh& mesh = hung.cloth.mesh;
    SpringFactors<> factors = SpringFactors<>::ones(mesh);
    SpringFactors<SingleLane> single_factors = SpringFactors<SingleLane>::ones(mesh);
    for (size_t type = 0; type < kSpringTypes; ++type) {
      for (Eigen::Index v = 0; v < mesh.vertex_count(); ++v) {
        factors.stiffness[type][v] = uniform(0.5, 2);
        factors.natural_length[type][v] = uniform(0.9, 1.1);
      }
      single_factors.stiffness[type] = factors.stiffness[type];
      single_factors.natural_length[type] = factors.natural_length[type];
    }
    const LaneParameters<> lanes = lane_parameters<ExactLanes>(hung.cloth, {&hung.set, 1});
    const LaneParameters<SingleLane> single =
        lane_parameters<SingleLane>(hung.cloth, {&hung.set, 1});
    LaneVectors<SingleLane> position = LaneVectors<SingleLane>::zero(mesh.vertex_count());
    LaneVectors<SingleLane> velocity = position, force = position;
    position.set_lane(0, hung.set.start_position_m);
    velocity.set_lane(0, hung.velocity_m_per_s);

    // when the forces are added up in both,
    ClothSweep<SingleLane>(mesh).add_spring_forces(single.springs, position, velocity, force,
                                                   &single_factors);
    const auto forces = [&](const SpringFactors<>* of_springs) {
      LaneVectors<> sum = LaneVectors<>::zero(mesh.vertex_count());
      ClothSweep<>(mesh).add_spring_forces(lanes.springs, every_lane(hung.set.start_position_m),
                                           every_lane(hung.velocity_m_per_s), sum, of_springs);
      return sum.lane(0);
    };

    // then they agree, and not with springs all alike.
    EXPECT_EQ(force.lane(0), forces(&factors));
    EXPECT_GT((force.lane(0) - forces(nullptr)).cwiseAbs().maxCoeff(), 0.01);
  }
}

INSTANTIATE_TEST_SUITE_P(InstructionSets, SingleLaneOn, testing::ValuesIn(instruction_sets()),
                         [](const auto& set) { return set.param.name(); });

class FastLanesOn : public testing::TestWithParam<InstructionSet> {};

TEST_P(FastLanesOn, StayNearTheExactOnesForASecondOfSwinging) {
  const OnInstructionSet on(GetParam());
  for (const StrainLimitMode mode : {StrainLimitMode::off, StrainLimitMode::positions,
                                     StrainLimitMode::rates_first, StrainLimitMode::consistent}) {
    SCOPED_TRACE(static_cast<int>(mode));
    const bool limited = mode != StrainLimitMode::off;
    // Given a cloth like the bundled recordings', let go from 20 degrees beside where it hangs. One
    // that folds is chaotic: any difference grows.
    Cloth cloth = square_cloth(17);
    cloth.held = {held_at(cloth.mesh, 0, 0), held_at(cloth.mesh, 0.4, 0)};
    cloth.strain_limit.mode = mode;
    ParameterSet set;
    set.springs = spring_parameters(cotton(), cloth.mesh);
    set.start_position_m = Eigen::AngleAxisd(0.35, Eigen::Vector3d::UnitX()).toRotationMatrix() *
                           hung_flat(cloth.mesh);
    if (limited) set.springs.critical_elongation.fill(0.002);
    SteppedCloth<FastLanes> fast(cloth, set, at_rest(set.start_position_m));
    SteppedCloth<ExactLanes> exact(cloth, set, at_rest(set.start_position_m));

    double largest_m = 0, travelled_m = 0, too_long = 0;
    for (int n = 0; n < 4000; ++n) {
      fast.step(2.5e-4);
      exact.step(2.5e-4);
      too_long += exact.limit_outcome().too_long[0];
      if (n % 100 != 99) continue;
      const Eigen::Matrix3Xd p = exact.position_m();
      largest_m = std::max(largest_m, (fast.position_m() - p).colwise().norm().maxCoeff());
      travelled_m = std::max(travelled_m, (p - set.start_position_m).colwise().norm().maxCoeff());
    }

    // then no vertex is far from where it should be. Rounding of 1e-8 m grows where the cloth
    // buckles, and where it decides which spring is too long. Seen were 0.9 mm without a limit, 3
    // um where one sweep keeps the cloth taut, 2.7 mm by first rates, 7.2 mm with sweeps until all
    // springs are tolerable.
    RecordProperty("mode_" + std::to_string(static_cast<int>(mode)) + "_um",
                   std::to_string(1e6 * largest_m));
    const double bound_m = mode == StrainLimitMode::off           ? 3e-3
                           : mode == StrainLimitMode::positions   ? 1e-4
                           : mode == StrainLimitMode::rates_first ? 1e-2
                                                                  : 3e-2;
    EXPECT_LT(largest_m, bound_m);
    EXPECT_GT(largest_m, 0);
    EXPECT_GT(travelled_m, 0.1);
    if (limited) {
      EXPECT_GT(too_long, 0);
    }
  }
}

/// Returns the sets without the last, which takes ten seconds.
std::vector<InstructionSet> vector_sets() {
  std::vector<InstructionSet> sets = instruction_sets();
  if (sets.size() > 1) sets.pop_back();
  return sets;
}

INSTANTIATE_TEST_SUITE_P(InstructionSets, FastLanesOn, testing::ValuesIn(vector_sets()),
                         [](const auto& set) { return set.param.name(); });

}  // namespace
}  // namespace clothfit
