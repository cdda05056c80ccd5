// Checks natural lengths other than the stated ones. Not checked here: springs at ease at their
// natural length (step_test.cpp), and that fits find a size again (no test does).

#include <gtest/gtest.h>

#include "tests/model/spring_rig.h"

namespace clothfit {
namespace {

TEST(NaturalSize, KeepsTheContractOfEffects) {
  expect_effect_contract("natural_size", {.isotropic = true, .internal = true});
}

TEST(NaturalSize, IsAFabricWithOtherNaturalLengths) {
  // Two routes lead to one force: the effect on cotton, and springs whose natural lengths were
  // changed.
  Uniform uniform(3);
  effect_contract::State state(uniform);
  const Mesh& mesh = state.cloth.mesh;
  const SpringParameters stated = spring_parameters(cotton(), mesh);
  SpringParameters changed = stated;
  const double warp = -0.07, weft = 0.03;
  const std::array<double, kSpringTypes> by{warp, weft, (warp + weft) / 2, (warp + weft) / 2,
                                            warp, weft};
  for (size_t type = 0; type < by.size(); ++type) changed.natural_length_m[type] *= 1 + by[type];
  const auto springs_n = [&](const SpringParameters& springs) {
    return spring_forces_n(mesh, springs, state.position_m, state.velocity_m_per_s);
  };

  const Eigen::Matrix3Xd sum_n =
      springs_n(stated) +
      effect_contract::force_n(find_effect("natural_size", "test"), state, {warp, weft});

  EXPECT_LT((sum_n - springs_n(changed)).norm(), 1e-12 * sum_n.norm());
}

TEST(NaturalSize, ASheetOfItsOwnSizeIsAtEase) {
  // The cloth is shrunk alike in both directions, so that diagonals fit exactly.
  Uniform uniform(4);
  effect_contract::State state(uniform);
  const Mesh& mesh = state.cloth.mesh;
  const double change = -0.1;
  const Eigen::Matrix3Xd shrunk_m = (1 + change) * flat_positions(mesh);
  const Eigen::Matrix3Xd still = Eigen::Matrix3Xd::Zero(3, shrunk_m.cols());
  state.position_m = shrunk_m;
  state.velocity_m_per_s = still;

  const Eigen::Matrix3Xd springs_n =
      spring_forces_n(mesh, spring_parameters(cotton(), mesh), shrunk_m, still);
  const Eigen::Matrix3Xd sum_n =
      springs_n +
      effect_contract::force_n(find_effect("natural_size", "test"), state, {change, change});

  EXPECT_GT(springs_n.norm(), 0.1);  // the stated springs do push
  EXPECT_LT(sum_n.norm(), 1e-12 * springs_n.norm());
}

}  // namespace
}  // namespace clothfit
