// Checks gravity of another strength.

#include <gtest/gtest.h>

#include "tests/model/cloth_with_effect.h"

namespace clothfit {
namespace {

TEST(GravityScale, KeepsTheContractOfEffects) {
  expect_effect_contract("gravity_scale", {.proportional = true});
}

TEST(GravityScale, IsGravityOfThatStrength) {
  // A hung, swinging cloth cannot tell excess from a gravity that is stated larger.
  Uniform uniform(1);
  Cloth bare = square_cloth(6);
  bare.held = {held_at(bare.mesh, 0, 0), held_at(bare.mesh, 0.4, 0)};
  const Eigen::Matrix3Xd start = crumpled(bare.mesh, 0.2, uniform);
  const double h = 2e-4;
  ClothWithEffect stated(bare, "gravity_scale", {0}, start);
  stated.set.gravity_m_per_s2 *= 1.25;

  const auto scaled = ClothWithEffect(bare, "gravity_scale", {0.25}, start).after(1000, h);

  EXPECT_GT((scaled.position_m - start).cwiseAbs().maxCoeff(), 0.1);
  // The springs spread the rounding of 1000 steps.
  EXPECT_LT((scaled.position_m - stated.after(1000, h).position_m).cwiseAbs().maxCoeff(), 1e-10);
}

}  // namespace
}  // namespace clothfit
