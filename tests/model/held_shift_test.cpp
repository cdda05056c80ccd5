// Checks a parameter set's shifts of the motions of held points. That held points are at their
// places is checked in step_test.cpp and simulate_test.cpp.
#include <gtest/gtest.h>

#include <vector>

#include "model/integrate/adjoint.h"
#include "model/integrate/relax.h"
#include "model/rest/equilibrium.h"
#include "tests/model/hung_cloth.h"
#include "tests/model/swing.h"

namespace clothfit {
namespace {

using Motion = std::function<Eigen::Vector3d(double time_s)>;

/// Returns a drift and a swing that differ from set to set.
Motion random_shift(Uniform& uniform) {
  const Eigen::Vector3d drift = uniform.vectors(1, 0.1), swing = uniform.vectors(1, 5e-3);
  return [drift, swing](double time_s) -> Eigen::Vector3d {
    return time_s * drift + std::cos(30 * time_s) * swing;
  };
}

/// Makes a cloth whose motions have the shifts of a set in them.
Cloth with_shifts(Cloth cloth, const ParameterSet& set) {
  for (size_t h = 0; h < set.held_shift.size(); ++h)
    if (set.held_shift[h] && cloth.held[h].motion)
      cloth.held[h].motion = [motion = cloth.held[h].motion,
                              shift = set.held_shift[h]](double time_s) -> Eigen::Vector3d {
        return motion(time_s) + shift(time_s);
      };
  return cloth;
}

/// Makes a cloth with one corner fixed and one that moves.
Cloth driven_cloth() {
  Cloth cloth = hung_cloth(5);
  cloth.held[1].motion = [](double time_s) {
    return Eigen::Vector3d(0.39 - 0.2 * time_s, 0.1 * time_s, 0.01);
  };
  return cloth;
}

/// Returns sets of which every third shifts nothing. The others shift the moving corner, and in
/// vain the fixed one.
std::vector<ParameterSet> shifting_sets(const Cloth& cloth, int count, Uniform& uniform) {
  std::vector<ParameterSet> sets = random_sets(cloth, count, 8);
  for (int n = 0; n < count; ++n) {
    ParameterSet& set = sets[static_cast<size_t>(n)];
    set.effects.clear();
    if (n % 3 != 2) set.held_shift = {random_shift(uniform), random_shift(uniform)};
  }
  return sets;
}

TEST(HeldShift, GivesTheBitsOfAMotionThatHasItInIt) {
  Uniform uniform(1);
  const Cloth cloth = driven_cloth();
  // These are whole groups of lanes of either kind, and a few left over that run one by one.
  const std::vector<ParameterSet> sets = shifting_sets(cloth, 2 * kLanes + 3, uniform);
  std::vector<ParameterSet> plain = sets;
  for (ParameterSet& set : plain) set.held_shift.clear();
  const Schedule schedule{
      .frame_time_s = {0.1, 0.12, 0.15}, .time_step_s = 5e-4, .velocities = true};

  for (const Precision precision : {Precision::exact, Precision::fast}) {
    const auto shifted = simulate(cloth, sets, schedule, precision);

    for (size_t n = 0; n < sets.size(); ++n) {
      SCOPED_TRACE(testing::Message() << "seed 1, set " << n);
      const SimulateResult expected =
          simulate(with_shifts(cloth, sets[n]), plain, schedule, precision)[n];
      EXPECT_EQ(shifted[n].position_m, expected.position_m);
      EXPECT_EQ(shifted[n].velocity_m_per_s, expected.velocity_m_per_s);
    }
    const auto without = simulate(cloth, plain, schedule, precision);
    EXPECT_NE(shifted[0].position_m, without[0].position_m);
    EXPECT_EQ(shifted[2].position_m, without[2].position_m);
  }
}

TEST(HeldShift, MovesWhatRelaxesToo) {
  Uniform uniform(2);
  const Cloth cloth = driven_cloth();
  const std::vector<ParameterSet> sets = shifting_sets(cloth, kLanes + 1, uniform);
  constexpr double kTime = 0.2, kStep = 1e-3;

  const auto shifted = relax(cloth, sets, 9.81, kTime, kStep);

  for (size_t n = 0; n < sets.size(); ++n) {
    SCOPED_TRACE(testing::Message() << "seed 2, set " << n);
    ParameterSet plain = sets[n];
    plain.held_shift.clear();
    EXPECT_EQ(
        shifted[n].position_m,
        relax(with_shifts(cloth, sets[n]), {&plain, 1}, 9.81, kTime, kStep).front().position_m);
  }
  const Eigen::Vector3d place = cloth.held[1].motion(kTime) + sets[0].held_shift[1](kTime);
  EXPECT_LT((shifted[0].position_m.col(4) - place).norm(), 1e-15);
  EXPECT_EQ(held_targets_m(cloth, sets[0], kTime).col(1), place);
}

TEST(HeldShift, IsInTheSimulationsThatCarryDerivatives) {
  Uniform uniform(3);
  Swing swing(uniform);
  swing.set.held_shift = {nullptr, random_shift(uniform), random_shift(uniform)};
  ParameterSet plain = swing.set;
  plain.held_shift.clear();
  const Cloth cloth = with_shifts(swing.cloth, swing.set);
  const std::vector<Direction> directions{random_direction(swing.cloth, uniform)};
  ParameterSet rested = swing.set, plain_rested = plain;
  std::vector<Direction> along = directions, plain_along = directions;

  const TangentResult result =
      simulate_with_tangents(swing.cloth, swing.set, directions, swing.schedule);
  const TangentResult expected = simulate_with_tangents(cloth, plain, directions, swing.schedule);
  start_at_rest_with_tangents(swing.cloth, rested, along, 9.81, 0.01, 1e-3);
  start_at_rest_with_tangents(cloth, plain_rested, plain_along, 9.81, 0.01, 1e-3);

  EXPECT_EQ(result.run.position_m, expected.run.position_m);
  EXPECT_EQ(result.position_tangent, expected.position_tangent);
  EXPECT_EQ(rested.start_position_m, plain_rested.start_position_m);
  EXPECT_EQ(along[0].start_position_m, plain_along[0].start_position_m);
  EXPECT_EQ(simulate_with_fields(swing.cloth, swing.set, swing.schedule, {}).position_m,
            expected.run.position_m);
  EXPECT_NE(result.run.position_m,
            simulate_with_tangents(swing.cloth, plain, directions, swing.schedule).run.position_m);
}

TEST(HeldShift, HasItsDerivativeInTheDirectionsHeldMotion) {
  Uniform uniform(4);
  const Swing swing(uniform);
  Direction direction;
  direction.held_motion = {nullptr, nullptr, random_shift(uniform)};
  constexpr double kStep = 1e-5;
  const auto moved = [&](double by) {
    ParameterSet set = swing.set;
    set.held_shift = {nullptr, nullptr,
                      [change = direction.held_motion[2], by](double time_s) -> Eigen::Vector3d {
                        return by * change(time_s);
                      }};
    return simulate(swing.cloth, {&set, 1}, swing.schedule).front().position_m;
  };

  const TangentResult result =
      simulate_with_tangents(swing.cloth, swing.set, {&direction, 1}, swing.schedule);

  const auto ahead = moved(kStep), behind = moved(-kStep);
  for (size_t f = 1; f < swing.schedule.frame_time_s.size(); ++f) {
    SCOPED_TRACE(testing::Message() << "seed 4, frame " << f);
    const Eigen::Matrix3Xd& tangent = result.position_tangent[0][f];
    // The tolerance is that of tangents_test.cpp.
    EXPECT_LT((tangent - (ahead[f] - behind[f]) / (2 * kStep)).norm(), 1e-6 * tangent.norm());
  }
}

}  // namespace
}  // namespace clothfit
