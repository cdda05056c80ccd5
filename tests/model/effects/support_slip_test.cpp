// Checks supports that creep where the cloth pulls.

#include <gtest/gtest.h>

#include "tests/model/cloth_with_effect.h"

namespace clothfit {
namespace {

constexpr double kWeight_n = 0.025 * 9.81;  // weight of square_cloth

/// Makes a cloth of two columns that hangs by its two upper corners, each of which carries half of
/// it. Without shear springs nothing pulls the corners together.
ClothWithEffect hung_by_two(double mobility, double threshold, double point = 0) {
  Cloth bare = square_cloth(2);
  bare.held = {held_at(bare.mesh, 0, 0), held_at(bare.mesh, 0.4, 0)};
  ClothWithEffect cloth(bare, "support_slip", {mobility, threshold, point}, hung_flat(bare.mesh));
  cloth.set.springs.stiffness_n_per_m[shear_down] = 0;
  cloth.set.springs.stiffness_n_per_m[shear_up] = 0;
  return cloth;
}

TEST(SupportSlip, KeepsTheContractOfEffects) {
  expect_effect_contract("support_slip", {});
}

TEST(SupportSlip, HangingClothComesDownAtMobilityTimesTheExcessOfItsWeight) {
  for (const auto& [mobility, threshold] : {std::pair{0.02, 0.0}, {0.05, 0.08}}) {
    SCOPED_TRACE(testing::Message() << mobility << ", " << threshold);

    // The springs' swing dies out as e^(-5 t); the supports' own ease only adds to that.
    const auto state = hung_by_two(mobility, threshold).after(8000, 1e-3);

    const Eigen::Vector3d expected(0, 0, -mobility * (kWeight_n / 2 - threshold));
    EXPECT_LT((state.velocity_m_per_s.colwise() - expected).cwiseAbs().maxCoeff(), 1e-11);
  }
}

TEST(SupportSlip, HoldsUpToTheThreshold) {
  // A load that is let go from a slack spring pulls with twice its weight at most. Below that
  // nothing creeps.
  const auto state = hung_by_two(0.05, 1.01 * kWeight_n).after(1000, 1e-3);

  EXPECT_EQ(state.position_m.leftCols(2), hung_by_two(0, 0).set.start_position_m.leftCols(2));
}

TEST(SupportSlip, OfASinglePointLeavesTheOtherWhereItIs) {
  const ClothWithEffect cloth = hung_by_two(0.05, 0.03, 2);
  const Eigen::Matrix3Xd start = cloth.set.start_position_m;

  const Eigen::Matrix3Xd after = cloth.after(500, 1e-3).position_m;

  EXPECT_EQ(after.col(0), start.col(0));
  EXPECT_LT(after(2, 1) - start(2, 1), -1e-3);
}

TEST(SupportSlip, TurnsWithTheScene) {
  Uniform uniform(7);
  const Eigen::Matrix3d turn = uniform.rotation();
  const ClothWithEffect here = hung_by_two(0.05, 0.03);
  ClothWithEffect there = here;
  there.set.start_position_m = turn * here.set.start_position_m;
  there.set.gravity_m_per_s2 = turn * here.set.gravity_m_per_s2;

  const Eigen::Matrix3Xd expected = turn * here.after(500, 1e-3).position_m;

  EXPECT_GT((expected - there.set.start_position_m).leftCols(2).norm(), 1e-3);
  EXPECT_LT((there.after(500, 1e-3).position_m - expected).cwiseAbs().maxCoeff(), 1e-12);
}

}  // namespace
}  // namespace clothfit
