// Checks warp against weft. Not checked here: the fabric's own stiffnesses (fabric_test.cpp).

#include <gtest/gtest.h>

#include "tests/model/spring_rig.h"

namespace clothfit {
namespace {

TEST(Anisotropy, KeepsTheContractOfEffects) {
  expect_effect_contract("anisotropy", {.isotropic = true, .proportional = true, .internal = true});
}

TEST(Anisotropy, IsAFabricWithStifferWarpAndSofterWeft) {
  // Two routes lead to one force: the effect on cotton, and the fabric that its definition names.
  for (const double a : {0.4, -0.7}) {
    Uniform uniform(2);
    effect_contract::State state(uniform);
    const Mesh& mesh = state.cloth.mesh;
    const Fabric even = cotton();
    Fabric uneven = even;
    uneven.tension_warp_n_per_m *= 1 + a;
    uneven.flexion_warp_n_per_m *= 1 + a;
    uneven.tension_weft_n_per_m *= 1 - a;
    uneven.flexion_weft_n_per_m *= 1 - a;
    const auto springs_n = [&](const Fabric& fabric) {
      return spring_forces_n(mesh, spring_parameters(fabric, mesh), state.position_m,
                             state.velocity_m_per_s);
    };

    const Eigen::Matrix3Xd sum_n =
        springs_n(even) + effect_contract::force_n(find_effect("anisotropy", "test"), state, {a});

    EXPECT_LT((sum_n - springs_n(uneven)).norm(), 1e-12 * sum_n.norm());
  }
}

TEST(Anisotropy, AStripUnderLoadStretchesByLoadOverStiffness) {
  DrivenRibbon ribbon(2, 40, "anisotropy", {0.5});

  // This is the effect's part of T = k (1 + a) dl.
  EXPECT_NEAR(ribbon.tension_n(0.03, 0, 1e-3), 0.5 * 40 * 0.03 * 0.4, 1e-15);
}

}  // namespace
}  // namespace clothfit
