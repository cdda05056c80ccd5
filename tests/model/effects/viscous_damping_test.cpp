// Checks viscous damping by the air. Not checked here: that time steps are chosen with it in mind
// (stability_test.cpp).

#include <gtest/gtest.h>

#include <cmath>

#include "model/effects/registry.h"
#include "tests/model/effect_contract.h"

namespace clothfit {
namespace {

/// A cloth of `vertices_per_side` that falls freely through air from rest, for `steps` steps.
struct Fall {
  Cloth cloth;
  ParameterSet set;

  Fall(const Cloth& bare, double rate_per_s, const Eigen::Matrix3d& attitude) : cloth(bare) {
    add_effect(cloth, "viscous_damping", "test");
    set.springs = spring_parameters(cotton(), cloth.mesh);
    set.effects = {{rate_per_s}};
    set.start_position_m = attitude * flat_positions(cloth.mesh);
  }
  Eigen::Matrix3Xd velocity_m_per_s(double time_step_s, int steps) const {
    SteppedCloth<> run(cloth, set, at_rest(set.start_position_m));
    for (int n = 0; n < steps; ++n) run.step(time_step_s);
    return run.velocity_m_per_s();
  }
};

TEST(ViscousDamping, KeepsTheContractOfEffects) {
  expect_effect_contract("viscous_damping",
                         {.isotropic = true, .only_damps = true, .proportional = true});
}

TEST(ViscousDamping, AFallingSheetReachesGravityOverRateWhateverItsAttitude) {
  const double rate_per_s = 8;
  Uniform uniform(1);
  for (int n = 0; n < 3; ++n) {
    const Eigen::Matrix3d attitude = uniform.rotation();
    SCOPED_TRACE(testing::Message() << "attitude\n" << attitude);

    const Eigen::Matrix3Xd v =
        Fall(square_cloth(5), rate_per_s, attitude).velocity_m_per_s(1e-3, 4000);

    // After 32 time constants nothing of the start remains.
    EXPECT_LT((v.colwise() - Eigen::Vector3d(0, 0, -9.81 / rate_per_s)).cwiseAbs().maxCoeff(),
              1e-12);
  }
}

TEST(ViscousDamping, VelocityFollowsTheClosedFormOfTheScheme) {
  const double rate_per_s = 2, h = 1e-3;
  const Fall fall(square_cloth(5), rate_per_s, Eigen::Matrix3d::Identity());

  for (const int steps : {1, 10, 500}) {
    // With V_{n+1} = V_n + h (g - rate V_n), V_n = g / rate (1 - (1 - h rate)^n).
    const double expected = -9.81 / rate_per_s * (1 - std::pow(1 - h * rate_per_s, steps));

    EXPECT_LT((fall.velocity_m_per_s(h, steps).row(2).array() - expected).abs().maxCoeff(), 1e-12)
        << steps;
  }
}

TEST(ViscousDamping, LetsADriftDieOutGeometrically) {
  Fall fall(square_cloth(5), 3, Eigen::Matrix3d::Identity());
  fall.set.gravity_m_per_s2.setZero();
  const Eigen::Vector3d drift(1, -2, 0.5);
  const double h = 2e-3;

  SteppedCloth<> run(fall.cloth, fall.set, drift.replicate(1, 25));
  for (int n = 0; n < 300; ++n) run.step(h);

  const Eigen::Vector3d expected = drift * std::pow(1 - h * 3, 300);
  EXPECT_LT((run.velocity_m_per_s().colwise() - expected).cwiseAbs().maxCoeff(), 1e-13);
}

TEST(ViscousDamping, SurvivesAChangeOfMeshAndOfTheMassesOnIt) {
  // The amplitude is per mass: neither the number of vertices nor the weight of each matters to a
  // fall.
  const auto speed = [](const Cloth& cloth) {
    return Fall(cloth, 2, Eigen::Matrix3d::Identity()).velocity_m_per_s(1e-3, 500).row(2).mean();
  };
  Cloth equal = square_cloth(9);
  equal.mass_kg = masses_equal(equal.mesh, equal.mesh, 0.1);

  const double coarse = speed(square_cloth(3));

  EXPECT_NEAR(speed(square_cloth(9)), coarse, 1e-12);
  EXPECT_NEAR(speed(equal), coarse, 1e-12);
}

}  // namespace
}  // namespace clothfit
