// Checks a tension curve that is not straight.

#include <gtest/gtest.h>

#include <cmath>

#include "model/effects/registry.h"
#include "tests/model/spring_rig.h"

namespace clothfit {
namespace {

constexpr double kSoft_n_per_m = 40, kLength_m = 0.4, kStrain = 0.02;

double tension_n(double stretched, double compressed, double elongation) {
  DrivenRibbon ribbon(2, kSoft_n_per_m, "stiffening", {stretched, compressed, kStrain});
  return ribbon.tension_n(elongation, 0, 1e-3) +
         kSoft_n_per_m * kLength_m * elongation;  // with the spring's own
}

TEST(Stiffening, KeepsTheContractOfEffects) {
  expect_effect_contract("stiffening", {.isotropic = true, .internal = true});
}

TEST(Stiffening, StiffnessIsTheSpringsOwnAtNoElongationOnBothSides) {
  for (const double e : {1e-7, -1e-7}) {
    EXPECT_NEAR(tension_n(3, 0.8, e) / e, kSoft_n_per_m * kLength_m,
                1e-4 * kSoft_n_per_m)
        << e;  // 3 e / strain of it
  }
}

TEST(Stiffening, FarStretchedOrCompressedItsStiffnessIsTheOneThatTheParametersName) {
  const auto slope = [](double at) {
    return (tension_n(3, 0.8, at + 1e-4) - tension_n(3, 0.8, at - 1e-4)) / 2e-4 /
           (kSoft_n_per_m * kLength_m);
  };
  // The slope lacks (strain / (|e| + strain))^2 of the change: 0.04 % at |e| = 0.98.
  EXPECT_NEAR(slope(0.98), 1 + 3, 3 * 1e-3);
  EXPECT_NEAR(slope(-0.98), 1 - 0.8, 1e-3);
}

TEST(Stiffening, AHangingLoadStretchesTheSpringByTheRootOfAQuadratic) {
  // T = k l0 (e + b e^2 / (e + c)) gives (1 + b) e^2 + (c - f) e - f c = 0 with f = T / (k l0).
  const double b = 4, load_n = 0.9;
  const double f = load_n / (kSoft_n_per_m * kLength_m), q = kStrain - f;
  const double expected = (-q + std::sqrt(q * q + 4 * (1 + b) * f * kStrain)) / (2 * (1 + b));
  // The oscillator's masses are loaded by gravity along t and braked until they rest.
  const Mesh mesh{.columns = 2, .rows = 2, .width_m = 0.1, .height_m = kLength_m};
  Cloth cloth = Cloth::of(mesh, Eigen::VectorXd::Constant(4, 0.01));
  cloth.held = {held_at(mesh, 0, 0), held_at(mesh, 0.1, 0)};
  add_effect(cloth, "stiffening", "test");
  add_effect(cloth, "viscous_damping", "test");
  const ParameterSet set{.springs = warp_springs(mesh, kSoft_n_per_m),
                         .gravity_m_per_s2 = {0, load_n / 0.01, 0},
                         .effects = {{b, 0, kStrain}, {30}},
                         .start_position_m = flat_positions(mesh)};
  SteppedCloth<> run(cloth, set, at_rest(set.start_position_m));

  for (int n = 0; n < 4000; ++n) run.step(5e-4);

  // A share exp(-30 / 2 * 2 s) of the start remains.
  EXPECT_NEAR((run.position_m()(1, 2) - kLength_m) / kLength_m, expected, 1e-12);
}

}  // namespace
}  // namespace clothfit
