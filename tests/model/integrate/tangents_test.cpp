// Checks derivatives of whole simulations. They are compared with differences, and to the bits with
// simulate(). Those along effects that a cloth does not have are compared with those of a cloth
// that has them. Contributions of single effects are compared with differences in effect_contract.h
// too.

#include "model/integrate/tangents.h"

#include <gtest/gtest.h>

#include "model/effects/registry.h"
#include "tests/model/instruction_sets.h"
#include "tests/model/swing.h"

namespace clothfit {
namespace {

/// Runs the simulation a small way along the direction.
std::vector<Eigen::Matrix3Xd> moved(const Cloth& cloth, ParameterSet set, const Direction& d,
                                    double by, const Schedule& schedule) {
  for (size_t type = 0; type < kSpringTypes; ++type) {
    set.springs.natural_length_m[type] += by * d.natural_length_m[type];
    set.springs.stiffness_n_per_m[type] += by * d.stiffness_n_per_m[type];
    set.springs.damping_ns_per_m[type] += by * d.damping_ns_per_m[type];
    set.springs.critical_elongation[type] += by * d.critical_elongation[type];
  }
  set.gravity_m_per_s2 += by * d.gravity_m_per_s2;
  for (size_t e = 0; e < d.effects.size(); ++e)
    for (size_t p = 0; p < d.effects[e].size(); ++p) set.effects[e][p] += by * d.effects[e][p];
  set.start_position_m += by * d.start_position_m;
  set.start_velocity_m_per_s += by * d.start_velocity_m_per_s;
  for (size_t e = 0; e < set.start_effect_memory.size(); ++e)
    set.start_effect_memory[e] += by * d.start_effect_memory[e];
  Cloth there = cloth;
  for (size_t h = 0; h < d.held_motion.size(); ++h)
    if (d.held_motion[h])
      there.held[h].motion = [of = cloth.held[h].motion, change = d.held_motion[h],
                              by](double time_s) -> Eigen::Vector3d {
        return of(time_s) + by * change(time_s);
      };
  return simulate(there, {&set, 1}, schedule).front().position_m;
}

/// Returns the largest difference between tangents and central differences, relative to the
/// tangents' size.
double error_of_tangents(const Cloth& cloth, const ParameterSet& set, const Direction& direction,
                         const Schedule& schedule, double by) {
  const TangentResult result = simulate_with_tangents(cloth, set, {&direction, 1}, schedule);
  const auto ahead = moved(cloth, set, direction, by, schedule);
  const auto behind = moved(cloth, set, direction, -by, schedule);
  double worst = 0;
  for (size_t f = 1; f < schedule.frame_time_s.size(); ++f) {
    const Eigen::Matrix3Xd& tangent = result.position_tangent[0][f];
    const Eigen::Matrix3Xd difference = (ahead[f] - behind[f]) / (2 * by);
    worst = std::max(worst, (tangent - difference).norm() / tangent.norm());
  }
  return worst;
}

TEST(Tangents, AgreeWithCentralDifferences) {
  for (const unsigned seed : {1u, 2u, 3u}) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    Uniform uniform(seed);
    const Swing swing(uniform);
    const Direction direction = random_direction(swing.cloth, uniform);

    // Differences of 1e-5 are off by 1e-10 from their curvature and 1e-11 from rounding. Some
    // hundred steps of a crumpled cloth enlarge that.
    EXPECT_LT(error_of_tangents(swing.cloth, swing.set, direction, swing.schedule, 1e-5), 1e-6);
  }
}

TEST(Tangents, AgreeWithCentralDifferencesAtTheStrainLimit) {
  for (const StrainLimitMode mode :
       {StrainLimitMode::positions, StrainLimitMode::rates_first, StrainLimitMode::consistent}) {
    for (const unsigned seed : {1u, 2u, 3u}) {
      SCOPED_TRACE(testing::Message() << "mode " << static_cast<int>(mode) << ", seed " << seed);
      Uniform uniform(seed);
      Swing swing(uniform);
      swing.cloth.strain_limit.mode = mode;
      swing.set.springs.critical_elongation.fill(0.03);
      swing.schedule.frame_time_s = {0, 0.002, 0.004};
      const Direction direction = random_direction(swing.cloth, uniform);

      Cloth unlimited = swing.cloth;
      unlimited.strain_limit.mode = StrainLimitMode::off;
      ASSERT_NE(simulate(unlimited, {&swing.set, 1}, swing.schedule).front().position_m,
                simulate(swing.cloth, {&swing.set, 1}, swing.schedule).front().position_m);

      // Steps are so small that no spring reaches or leaves its limit within them.
      EXPECT_LT(error_of_tangents(swing.cloth, swing.set, direction, swing.schedule, 1e-7), 1e-6);
    }
  }
}

TEST(Tangents, AgreeWithCentralDifferencesUnderWindAndDamping) {
  for (const unsigned seed : {1u, 2u}) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    Uniform uniform(seed);
    Swing swing(uniform);
    add_effect(swing.cloth, "wind", "test");
    add_effect(swing.cloth, "viscous_damping", "test");
    swing.set.effects = {{0.1, 0.2, -0.3, 0.4}, {0.7}};
    const Direction direction = random_direction(swing.cloth, uniform);

    EXPECT_LT(error_of_tangents(swing.cloth, swing.set, direction, swing.schedule, 1e-5), 1e-6);
  }
}

TEST(Tangents, AgreeWithCentralDifferencesUnderEveryEffect) {
  for (const EffectEntry& entry : effect_registry()) {
    SCOPED_TRACE(entry.name);
    Uniform uniform(7);
    const Swing swing = swing_under(entry, uniform);
    const Direction direction = random_direction(swing.cloth, uniform);

    EXPECT_LT(error_of_tangents(swing.cloth, swing.set, direction, swing.schedule, 1e-6), 1e-6);
  }
}

/// Checks that single precision changes many tangents by little, and the run not at all.
void expect_five_digits(const Swing& swing, Uniform& uniform) {
  std::vector<Direction> directions;
  for (int d = 0; d < 17; ++d) directions.push_back(random_direction(swing.cloth, uniform));
  Schedule fast = swing.schedule;
  fast.fast_derivatives = true;
  const TangentResult exact =
      simulate_with_tangents(swing.cloth, swing.set, directions, swing.schedule);
  const TangentResult found = simulate_with_tangents(swing.cloth, swing.set, directions, fast);

  EXPECT_EQ(found.run.position_m, exact.run.position_m);
  ASSERT_EQ(found.position_tangent.size(), directions.size());
  EXPECT_NE(found.position_tangent, exact.position_tangent);
  for (size_t d = 0; d < directions.size(); ++d) {
    const Eigen::Matrix3Xd& expected = exact.position_tangent[d].back();
    EXPECT_LT((found.position_tangent[d].back() - expected).norm(), 1e-5 * expected.norm());
  }
}

TEST(Tangents, InSinglePrecisionAreRightToFiveDigitsUnderEveryEffect) {
  for (const EffectEntry& entry : effect_registry()) {
    SCOPED_TRACE(entry.name);
    Uniform uniform(9);
    const Swing swing = swing_under(entry, uniform);
    expect_five_digits(swing, uniform);
  }
}

TEST(Tangents, InSinglePrecisionAreRightToFiveDigitsOnEveryInstructionSet) {
  for (const InstructionSet& set : instruction_sets()) {
    SCOPED_TRACE(set);
    const OnInstructionSet on(set);
    Uniform uniform(9);
    const Swing swing(uniform);
    expect_five_digits(swing, uniform);
  }
}

TEST(Tangents, AreTheSameBitsOnEveryInstructionSet) {
  for (const StrainLimitMode mode : {StrainLimitMode::off, StrainLimitMode::consistent})
    for (const bool fast : {false, true}) {
      SCOPED_TRACE(testing::Message() << "mode " << static_cast<int>(mode) << ", fast " << fast);
      Uniform uniform(3);
      Swing swing(uniform);
      swing.cloth.strain_limit.mode = mode;
      swing.set.springs.critical_elongation.fill(0.03);
      add_effect(swing.cloth, "wind", "test");
      swing.set.effects = {{0.1, 0.2, -0.3, 0.4}};
      swing.schedule.fast_derivatives = fast;
      std::vector<Direction> directions;
      for (int d = 0; d < 17; ++d) directions.push_back(random_direction(swing.cloth, uniform));
      const auto tangents = [&] {
        return simulate_with_tangents(swing.cloth, swing.set, directions, swing.schedule)
            .position_tangent;
      };

      const auto here = tangents();

      for (const InstructionSet& set : instruction_sets()) {
        const OnInstructionSet on(set);
        EXPECT_TRUE(tangents() == here) << set;
      }
    }
}

TEST(Tangents, InSinglePrecisionAreRightToFiveDigitsAtTheStrainLimit) {
  Uniform uniform(9);
  Swing swing(uniform);
  swing.cloth.strain_limit.mode = StrainLimitMode::consistent;
  swing.set.springs.critical_elongation.fill(0.03);
  swing.schedule.frame_time_s = {0, 0.002, 0.004};
  expect_five_digits(swing, uniform);
}

TEST(Tangents, WithDerivativesThatAreKeptErrByTheMotionInThatTime) {
  Uniform uniform(5);
  Swing swing(uniform);
  add_effect(swing.cloth, "wind", "test");
  add_effect(swing.cloth, "added_air_mass", "test");  // it changes forces
  swing.set.effects = {{0.1, 0.2, -0.3, 0.4}, {0.05}};
  Direction direction;
  direction.effects = {{0.1, 0.2, 0.3, 0.1}, {0.01}};
  const auto tangents = [&](double kept_s) {
    Schedule schedule = swing.schedule;
    schedule.derivatives_kept_s = kept_s;
    return simulate_with_tangents(swing.cloth, swing.set, {&direction, 1}, schedule);
  };
  const TangentResult exact = tangents(0), kept = tangents(1e-3);

  EXPECT_EQ(kept.run.position_m, exact.run.position_m);
  const Eigen::Matrix3Xd& expected = exact.position_tangent.front().back();
  const double error = (kept.position_tangent.front().back() - expected).norm() / expected.norm();
  EXPECT_GT(error, 0);
  EXPECT_LT(error, 0.02);
}

TEST(Tangents, AlongAnEmergingEffectAreThoseOfAClothThatHasItAtItsNeutralValues) {
  // The modes are forces, also with a memory; inertia; supports. More than go side by side.
  constexpr EmergingParameter kEmerging[] = {{"wind", "q_x"},
                                             {"wind", "c"},
                                             {"viscous_damping", "rate"},
                                             {"frame_acceleration", "a_y"},
                                             {"gravity_tilt", "about_x"},
                                             {"relaxation", "ratio"},
                                             {"hysteresis", "ratio"},
                                             {"nonuniform_mass", "hem_bottom"},
                                             {"nonuniform_mass", "gradient_s"},
                                             {"added_air_mass", "mu"},
                                             {"support_motion", "amplitude_x"}};
  Uniform uniform(1);
  const Swing plain(uniform);
  Swing windy = plain;
  add_effect(windy.cloth, "wind", "test");
  windy.set.effects = {{0.1, 0.2, -0.3, 0.4}};
  // At steps shorter than that, forces are carried on between.
  for (const double time_step_s : {kEmergingInterval_s, kEmergingInterval_s / 2}) {
    // The small change that stands for a derivative errs by 1e-5 of the curvature.
    const double tolerance = time_step_s < kEmergingInterval_s ? 1e-2 : 1e-4;
    for (const Swing* swing : {&plain, static_cast<const Swing*>(&windy)}) {
      Schedule schedule = swing->schedule;
      schedule.time_step_s = time_step_s;
      std::vector<Direction> directions;
      for (const EmergingParameter& parameter : kEmerging)
        directions.push_back(TwoWays(swing->cloth, swing->set, parameter).emerging);

      const TangentResult result =
          simulate_with_tangents(swing->cloth, swing->set, directions, schedule);

      EXPECT_EQ(result.run.position_m,
                simulate(swing->cloth, {&swing->set, 1}, schedule).front().position_m);
      for (size_t d = 0; d < directions.size(); ++d) {
        SCOPED_TRACE(testing::Message()
                     << kEmerging[d].effect << '.' << kEmerging[d].amplitude << ", "
                     << swing->cloth.effects.size() << " effects, steps of " << time_step_s);
        const TwoWays with(swing->cloth, swing->set, kEmerging[d]);
        const TangentResult expected =
            simulate_with_tangents(with.cloth, with.set, {&with.present, 1}, schedule);
        for (size_t f = 1; f < schedule.frame_time_s.size(); ++f) {
          const Eigen::Matrix3Xd& tangent = expected.position_tangent[0][f];
          EXPECT_GT(tangent.norm(), 0);
          EXPECT_LT((result.position_tangent[d][f] - tangent).norm(), tolerance * tangent.norm())
              << f;
        }
      }
    }
  }
}

TEST(Tangents, AlongEmergingEffectsInSinglePrecisionAreRightToFiveDigits) {
  Uniform uniform(9);
  const Swing swing(uniform);
  std::vector<Direction> directions;
  for (int d = 0; d < 17; ++d)
    directions.push_back(TwoWays(swing.cloth, swing.set, {"viscous_damping", "rate"}).emerging);
  Schedule fast = swing.schedule;
  fast.fast_derivatives = true;
  const auto last = [&](const Schedule& schedule) {
    return simulate_with_tangents(swing.cloth, swing.set, directions, schedule)
        .position_tangent.back()
        .back();
  };
  const Eigen::Matrix3Xd exact = last(swing.schedule), found = last(fast);
  EXPECT_LT((found - exact).norm(), 1e-5 * exact.norm());
}

// The two know nothing of each other: the tangent along both is the sum.
TEST(Tangents, AlongAnEmergingEffectAddToThoseOfAllElse) {
  Uniform uniform(2);
  const Swing swing(uniform);
  const Direction emerging = TwoWays(swing.cloth, swing.set, {"viscous_damping", "rate"}).emerging;
  const Direction other = random_direction(swing.cloth, uniform);
  Direction both = other;
  both.emerging = emerging.emerging;

  const TangentResult result = simulate_with_tangents(
      swing.cloth, swing.set, std::vector<Direction>{emerging, other, both}, swing.schedule);

  for (size_t f = 1; f < swing.schedule.frame_time_s.size(); ++f) {
    const auto& tangent = result.position_tangent;
    EXPECT_LT((tangent[2][f] - tangent[0][f] - tangent[1][f]).norm(), 1e-9 * tangent[2][f].norm());
  }
}

TEST(Tangents, CarryASimulationOfTheSameBits) {
  for (const StrainLimitMode mode : {StrainLimitMode::off, StrainLimitMode::positions,
                                     StrainLimitMode::rates_first, StrainLimitMode::consistent}) {
    SCOPED_TRACE(static_cast<int>(mode));
    Uniform uniform(4);
    Swing swing(uniform);
    swing.cloth.strain_limit.mode = mode;
    swing.set.springs.critical_elongation.fill(0.03);
    add_effect(swing.cloth, "wind", "test");
    swing.set.effects = {{0.1, 0.2, -0.3, 0.4}};

    const TangentResult result =
        simulate_with_tangents(swing.cloth, swing.set,
                               std::vector{random_direction(swing.cloth, uniform)}, swing.schedule);

    EXPECT_EQ(result.run.position_m,
              simulate(swing.cloth, {&swing.set, 1}, swing.schedule).front().position_m);
  }
}

TEST(Tangents, DoNotDependOnTheOtherDirections) {
  Uniform uniform(5);
  const Swing swing(uniform);
  std::vector<Direction> directions;
  for (int d = 0; d < 11; ++d) directions.push_back(random_direction(swing.cloth, uniform));

  const TangentResult together =
      simulate_with_tangents(swing.cloth, swing.set, directions, swing.schedule);

  ASSERT_EQ(together.position_tangent.size(), 11u);
  for (size_t d = 0; d < 11; ++d)
    EXPECT_EQ(together.position_tangent[d],
              simulate_with_tangents(swing.cloth, swing.set, {&directions[d], 1}, swing.schedule)
                  .position_tangent[0]);
}

TEST(Tangents, AreLinearInTheDirection) {
  Uniform uniform(6);
  const Swing swing(uniform);
  const Direction once = random_direction(swing.cloth, uniform);
  Direction twice = once;
  for (size_t type = 0; type < kSpringTypes; ++type) {
    twice.natural_length_m[type] *= 2;
    twice.stiffness_n_per_m[type] *= 2;
    twice.damping_ns_per_m[type] *= 2;
  }
  twice.gravity_m_per_s2 *= 2;
  twice.start_position_m *= 2;
  twice.start_velocity_m_per_s *= 2;
  for (auto& motion : twice.held_motion)
    if (motion) motion = [of = motion](double time_s) -> Eigen::Vector3d { return 2 * of(time_s); };

  const TangentResult result = simulate_with_tangents(
      swing.cloth, swing.set, std::vector<Direction>{once, twice}, swing.schedule);

  for (size_t f = 0; f < 4; ++f)  // doubling is exact
    EXPECT_EQ(result.position_tangent[1][f], 2 * result.position_tangent[0][f]);
}

}  // namespace
}  // namespace clothfit
