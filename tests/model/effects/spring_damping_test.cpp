// Checks damping along the springs beyond the common one. Not checked here: the common one
// (cloth_sweep_test.cpp).

#include <gtest/gtest.h>

#include "tests/model/spring_rig.h"

namespace clothfit {
namespace {

TEST(SpringDamping, KeepsTheContractOfEffects) {
  expect_effect_contract("spring_damping",
                         {.isotropic = true, .only_damps = true, .internal = true});
}

TEST(SpringDamping, AnOscillatorDecaysAsTheSchemeHasIt) {
  using Rig = SpringOscillator;
  const double time_s = 2e-3, h = 1e-3;
  const double frequency2 = Rig::kStiffness_n_per_m / Rig::kMass_kg, rate = time_s * frequency2;
  const std::vector<double> x = Rig("spring_damping", {time_s, 0, 0}, 0.02).extensions_m(h, 500);

  // The scheme is V_n+1 = V_n - h (w^2 x_n + rate V_n), x_n+1 = x_n + h V_n+1. So x_n+1 = (2 - h
  // rate - h^2 w^2) x_n - (1 - h rate) x_n-1: a share 1 - h rate per two steps.
  double before = 0.02, now = 0.02 * (1 - h * h * frequency2);
  for (size_t n = 1; n < x.size(); ++n) {
    EXPECT_NEAR(x[n], now, 1e-14) << n;
    const double next = (2 - h * rate - h * h * frequency2) * now - (1 - h * rate) * before;
    before = now;
    now = next;
  }
  EXPECT_LT(std::abs(x.back()), 0.02 * std::pow(1 - h * rate, 250));
}

TEST(SpringDamping, IsTheFabricsOwnDampingWhereAllTimesAreOne) {
  // The common damping is a retardation time too: beside each other they add.
  Uniform uniform(1);
  const Mesh mesh = square_mesh(6);
  const Eigen::Matrix3Xd p = crumpled(mesh, 0.3, uniform), v = uniform.vectors(36, 1);
  Fabric fabric = cotton();
  const Eigen::Matrix3Xd with_n = spring_forces_n(mesh, spring_parameters(fabric, mesh), p, v);
  fabric.damping_warp_s = fabric.damping_weft_s = 0;
  const Eigen::Matrix3Xd without_n = spring_forces_n(mesh, spring_parameters(fabric, mesh), p, v);
  effect_contract::State state(uniform);
  state.position_m = p;
  state.velocity_m_per_s = v;

  const Eigen::Matrix3Xd effect_n =
      effect_contract::force_n(find_effect("spring_damping", "test"), state, {1e-3, 1e-3, 1e-3});

  EXPECT_LT((effect_n - (with_n - without_n)).norm(), 1e-12 * with_n.norm());
}

TEST(SpringDamping, EachTimeActsOnItsOwnGroupOfSprings) {
  // A square of four masses is pulled along t only. Its structural springs stretch at the full
  // rate, the shear springs at half of it, there are no flexion springs.
  DrivenRibbon structural(2, 40, "spring_damping", {1e-3, 0, 0}),
      others(2, 40, "spring_damping", {0, 1e-3, 1e-3});

  EXPECT_NEAR(structural.tension_n(0.1, 2.0, 1e-3), 40 * 1e-3 * 2.0 * 0.4, 1e-15);
  EXPECT_EQ(others.tension_n(0.1, 2.0, 1e-3), 0);  // its shear springs have no stiffness
}

}  // namespace
}  // namespace clothfit
