// Checks the longest time step. Not checked here: a step itself (step_test.cpp) and what a run that
// diverges reports (simulate_test.cpp).

#include "model/cloth/stability.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "model/effects/registry.h"
#include "tests/model/mechanics.h"
#include "tests/model/random_cloth.h"

namespace clothfit {
namespace {

/// The margin for folded cloth that stable_time_step_s leaves on the squared frequencies.
constexpr double kMargin = 1.25;

/// A cloth of four vertices of mass `m` whose type 0 springs make it two pairs along t.
struct Pair {
  Cloth cloth;
  ParameterSet set;

  Pair(double m, double k, double c)
      : cloth(Cloth::of({.columns = 2, .rows = 2, .width_m = 0.1, .height_m = 0.1},
                        Eigen::VectorXd::Constant(4, m))) {
    set.springs.natural_length_m = flat_lengths(cloth.mesh);
    set.springs.stiffness_n_per_m[structural_t] = k;
    set.springs.damping_ns_per_m[structural_t] = c;
    set.gravity_m_per_s2.setZero();
    set.start_position_m = flat_positions(cloth.mesh);
    set.start_position_m(1, 2) += 1e-6;
  }

  /// Returns the largest extension within `steps` steps, as a multiple of the first.
  double growth(double time_step_s, int steps) const {
    SteppedCloth<> run(cloth, set, at_rest(set.start_position_m));
    double largest_m = 0;
    for (int n = 0; n < steps; ++n) {
      run.step(time_step_s);
      const Eigen::Matrix3Xd p = run.position_m();
      if (!p.allFinite()) return INFINITY;
      largest_m = std::max(largest_m, std::abs((p.col(2) - p.col(0)).norm() - 0.1));
    }
    return largest_m / 1e-6;
  }
};

/// Returns elastic plus kinetic energy after `steps` steps without gravity, as a multiple of the
/// first. It is infinite if it is no number any more.
double energy_growth(const Cloth& cloth, const ParameterSet& set, double time_step_s, int steps) {
  SteppedCloth<> run(cloth, set, at_rest(set.start_position_m));
  for (int n = 0; n < steps; ++n) run.step(time_step_s);
  const double growth = (elastic_energy_j(cloth.springs, set.springs, run.position_m()) +
                         kinetic_energy_j(cloth.mass_kg, run.velocity_m_per_s())) /
                        elastic_energy_j(cloth.springs, set.springs, set.start_position_m);
  return std::isfinite(growth) ? growth : INFINITY;
}

/// Returns the step at which the stiffest mode of the flat cloth at rest becomes unstable without
/// damping. It is 2 / omega, from all its eigenfrequencies.
double flat_limit_s(const Cloth& cloth, const SpringParameters& springs) {
  const Eigen::Matrix3Xd flat = flat_positions(cloth.mesh);
  const Eigen::Index vertices = flat.cols();
  Eigen::MatrixXd k = Eigen::MatrixXd::Zero(2 * vertices, 2 * vertices);
  for (size_t type = 0; type < kSpringTypes; ++type) {
    for (const auto& [a, b] : cloth.springs[type]) {
      const Eigen::Vector2d u = (flat.col(b) - flat.col(a)).head<2>().normalized();
      const Eigen::Matrix2d block = springs.stiffness_n_per_m[type] * u * u.transpose();
      k.block<2, 2>(2 * a, 2 * a) += block;
      k.block<2, 2>(2 * b, 2 * b) += block;
      k.block<2, 2>(2 * a, 2 * b) -= block;
      k.block<2, 2>(2 * b, 2 * a) -= block;
    }
  }
  for (Eigen::Index v = 0; v < vertices; ++v) {
    const double scale = 1 / std::sqrt(cloth.mass_kg[v]);
    k.middleRows<2>(2 * v) *= scale;
    k.middleCols<2>(2 * v) *= scale;
  }
  const double omega2 = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(k, Eigen::EigenvaluesOnly)
                            .eigenvalues()
                            .maxCoeff();
  return 2 / std::sqrt(omega2);
}

TEST(StableTimeStep, OfASpringPairHasAClosedForm) {
  const double m = 0.01;
  for (const auto& [k, c] : {std::pair{50.0, 0.0}, {50.0, 0.1}, {0.0, 0.1}, {5.0, 3.0}}) {
    SCOPED_TRACE(testing::Message() << "k " << k << ", c " << c);
    const Pair pair(m, k, c);

    const double h = stable_time_step_s(pair.cloth, pair.set);

    // At the limit 2 h gamma + h^2 omega^2 = 4 with omega^2 = 2 k / m and gamma = 2 c / m, both
    // with the margin.
    EXPECT_NEAR(kMargin * (2 * h * 2 * c / m + h * h * 2 * k / m), 4, 1e-12);
  }
}

TEST(StableTimeStep, IsWhereThePairTurnsUnstableOnceTheMarginIsTakenOff) {
  const double m = 0.01;
  for (const auto& [k, c] : {std::pair{50.0, 0.0}, {50.0, 0.1}, {5.0, 3.0}}) {
    SCOPED_TRACE(testing::Message() << "k " << k << ", c " << c);
    const Pair pair(m, k, c);
    const Pair relieved(m, k / kMargin, c / kMargin);
    const double h = stable_time_step_s(relieved.cloth, relieved.set);

    EXPECT_LT(pair.growth(0.99 * h, 2000), 10);  // swings on, at most by the scheme's own amplitude
    EXPECT_GT(pair.growth(1.01 * h, 2000), 1e3);
  }
}

TEST(StableTimeStep, FallsWithStiffnessAndDampingAndRisesWithMass) {
  const Pair pair(0.01, 50, 0.1);
  const double h = stable_time_step_s(pair.cloth, pair.set);

  EXPECT_LT(stable_time_step_s(pair.cloth, Pair(0.01, 60, 0.1).set), h);
  EXPECT_LT(stable_time_step_s(pair.cloth, Pair(0.01, 50, 0.2).set), h);
  EXPECT_GT(stable_time_step_s(Pair(0.02, 50, 0.1).cloth, pair.set), h);
}

TEST(StableTimeStep, IsUnboundedForClothWithoutSprings) {
  const Pair pair(0.01, 0, 0);

  EXPECT_EQ(stable_time_step_s(pair.cloth, pair.set), INFINITY);
}

TEST(StableTimeStep, CountsTheDampingOfEffects) {
  // Given a rigid drift that only viscous damping acts on, V_{n+1} = (1 - h rate) V_n,
  Pair pair(0.01, 0, 0);
  add_effect(pair.cloth, "viscous_damping", "test");
  pair.set.effects = {{25.0}};
  const Eigen::Matrix3Xd drift = Eigen::Matrix3Xd::Ones(3, 4);

  const double h = stable_time_step_s(pair.cloth, pair.set);
  const auto speed_after = [&](double time_step_s) {
    SteppedCloth<> run(pair.cloth, pair.set, drift);
    for (int n = 0; n < 200; ++n) run.step(time_step_s);
    return run.velocity_m_per_s()(0, 0);
  };

  EXPECT_DOUBLE_EQ(h, 2 / 25.0);
  EXPECT_LT(speed_after(0.95 * h), 1e-3);
  EXPECT_GT(std::abs(speed_after(1.05 * h)), 1e3);

  // and with springs the two rates add.
  Pair both(0.01, 0, 0.1);
  add_effect(both.cloth, "viscous_damping", "test");
  both.set.effects = {{25.0}};
  EXPECT_DOUBLE_EQ(stable_time_step_s(both.cloth, both.set), 2 / (25 + kMargin * 2 * 0.1 / 0.01));
}

TEST(StableTimeStep, IsBelowTheLimitOfTheFlatClothAndWithinAFactorOfIt) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    Uniform uniform(seed);
    Cloth cloth = square_cloth(9);
    if (seed % 2 == 0) cloth.mass_kg = masses_equal(cloth.mesh, cloth.mesh, 0.025);
    ParameterSet set{.springs = spring_parameters(random_fabric(uniform), cloth.mesh)};
    set.springs.damping_ns_per_m.fill(0);

    const double h = stable_time_step_s(cloth, set);
    const double limit = flat_limit_s(cloth, set.springs);

    // The margin alone costs a factor sqrt(1.25) = 1.12. The rest is that no single mode stretches
    // all springs of a vertex at once.
    EXPECT_LT(h * std::sqrt(kMargin), limit * (1 + 1e-12));
    EXPECT_GT(h, limit / 1.6);
  }
}

TEST(StableTimeStep, KeepsFlatClothBounded) {
  for (unsigned seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE(seed);
    Uniform uniform(seed);
    const Cloth cloth = square_cloth(7);
    ParameterSet set{.springs = spring_parameters(random_fabric(uniform), cloth.mesh),
                     .gravity_m_per_s2 = Eigen::Vector3d::Zero(),
                     .start_position_m = crumpled(cloth.mesh, 1e-4, uniform)};
    if (seed % 2 == 0) set.springs.damping_ns_per_m.fill(0);

    const double h = stable_time_step_s(cloth, set);

    // Close to the limit the scheme's own energy swings about the true one by a factor of a few.
    EXPECT_LT(energy_growth(cloth, set, 0.95 * h, 4000), 10);
  }
}

TEST(StableTimeStep, KeepsCrumpledClothBounded) {
  // Vertices of this cloth are moved by half a spacing. Its springs are then far from their
  // lengths, and some turn inside out. With dashpots it comes to rest all the same. Without any,
  // steps close to the limit pump energy into what is crumpled so violently, and half of them do
  // not come to rest.
  struct Case {
    double crumpling, damping, share_of_step;
  };
  for (const auto& [crumpling, damping, share_of_step] :
       {Case{0.5, 1, 0.95}, {0.1, 0, 0.95}, {0.5, 0, 0.5}}) {
    for (unsigned seed = 1; seed <= 6; ++seed) {
      SCOPED_TRACE(testing::Message() << "crumpled by " << crumpling << ", seed " << seed);
      Uniform uniform(100 + seed);
      const Cloth cloth = square_cloth(7);
      ParameterSet set{.springs = spring_parameters(random_fabric(uniform), cloth.mesh),
                       .gravity_m_per_s2 = Eigen::Vector3d::Zero(),
                       .start_position_m = crumpled(cloth.mesh, crumpling, uniform)};
      for (double& c : set.springs.damping_ns_per_m) c *= damping;

      const double h = stable_time_step_s(cloth, set);

      EXPECT_LT(energy_growth(cloth, set, share_of_step * h, 4000), damping > 0 ? 1e-3 : 2);
    }
  }
}

TEST(StableTimeStep, KeepsHeldSwingingClothBounded) {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE(seed);
    Uniform uniform(200 + seed);
    Cloth cloth = square_cloth(7);
    cloth.held = {held_at(cloth.mesh, 0, 0), held_at(cloth.mesh, 0.37, 0.01)};
    ParameterSet set{.springs = spring_parameters(random_fabric(uniform), cloth.mesh),
                     .start_position_m = flat_positions(cloth.mesh)};

    const double h = stable_time_step_s(cloth, set);
    SteppedCloth<> run(cloth, set, at_rest(set.start_position_m));
    double fastest = 0;
    for (int n = 0; n < 4000; ++n) {
      run.step(0.95 * h);
      fastest = std::max(fastest, run.velocity_m_per_s().colwise().norm().maxCoeff());
    }

    EXPECT_GT(fastest, 1);   // it fell
    EXPECT_LT(fastest, 30);  // and a whip's end is faster than a fall of 0.6 m, not by ten times
  }
}

TEST(StableTimeStep, FlatClothBlowsUpBeyondItsLimit) {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE(seed);
    Uniform uniform(seed);
    const Cloth cloth = square_cloth(7);
    ParameterSet set{.springs = spring_parameters(random_fabric(uniform), cloth.mesh),
                     .gravity_m_per_s2 = Eigen::Vector3d::Zero(),
                     .start_position_m = crumpled(cloth.mesh, 1e-4, uniform)};
    set.springs.damping_ns_per_m.fill(0);
    const double limit = flat_limit_s(cloth, set.springs);

    EXPECT_LT(energy_growth(cloth, set, 0.98 * limit, 1000), 100);
    EXPECT_GT(energy_growth(cloth, set, 1.03 * limit, 1000), 1e4);
    EXPECT_GT(energy_growth(cloth, set, 1.6 * stable_time_step_s(cloth, set), 1000), 1e4);
  }
}

}  // namespace
}  // namespace clothfit
