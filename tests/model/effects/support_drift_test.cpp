// Checks supports that drift.

#include <gtest/gtest.h>

#include "tests/model/cloth_with_effect.h"

namespace clothfit {
namespace {

TEST(SupportDrift, KeepsTheContractOfEffects) {
  expect_effect_contract("support_drift", {});
}

TEST(SupportDrift, IsAStartOfTheClothTheOtherWaySeenFromTheSupports) {
  // By Galilei, cloth at rest under supports that leave with v is cloth that leaves with -v.
  const Eigen::Vector3d v(0.1, -0.2, 0.05);
  Uniform uniform(6);
  Cloth bare = square_cloth(6);
  bare.held = {held_at(bare.mesh, 0, 0), held_at(bare.mesh, 0.31, 0.02)};
  const Eigen::Matrix3Xd start = crumpled(bare.mesh, 0.2, uniform);
  const int steps = 1500;
  const double h = 2e-4;
  const ClothWithEffect drifting(bare, "support_drift", {v.x(), v.y(), v.z(), 0}, start);
  ClothWithEffect resting(bare, "support_drift", {0, 0, 0, 0}, start);
  resting.set.start_velocity_m_per_s = (-v).replicate(1, 36);

  const Eigen::Matrix3Xd world = drifting.after(steps, h).position_m;

  EXPECT_LT((world.col(0) - start.col(0) - steps * h * v).norm(), 1e-14);
  // Crumpled cloth enlarges the rounding of 1500 steps.
  EXPECT_LT((world.colwise() - (steps * h * v) - resting.after(steps, h).position_m)
                .cwiseAbs()
                .maxCoeff(),
            1e-9);
}

TEST(SupportDrift, OfASinglePointLeavesTheOthersWhereTheyAre) {
  Cloth bare = square_cloth(6);
  bare.held = {held_at(bare.mesh, 0, 0), held_at(bare.mesh, bare.mesh.width_m, 0)};
  const Eigen::Matrix3Xd start = flat_positions(bare.mesh);
  const Eigen::Vector3d v(0.1, -0.2, 0.05);
  const int steps = 300;
  const double h = 1e-3;
  const auto shift_m = [&](double point, int vertex) -> Eigen::Vector3d {
    const ClothWithEffect drifting(bare, "support_drift", {v.x(), v.y(), v.z(), point}, start);
    return drifting.after(steps, h).position_m.col(vertex) - start.col(vertex);
  };

  EXPECT_LT((shift_m(1, 0) - steps * h * v).norm(), 1e-14);
  EXPECT_EQ(shift_m(1, 5), Eigen::Vector3d::Zero());
  EXPECT_EQ(shift_m(2, 0), Eigen::Vector3d::Zero());
  EXPECT_LT((shift_m(2, 5) - steps * h * v).norm(), 1e-14);
  for (const int vertex : {0, 5}) {
    EXPECT_LT((shift_m(0, vertex) - steps * h * v).norm(), 1e-14);
    EXPECT_EQ(shift_m(3, vertex), Eigen::Vector3d::Zero());  // there is none of that number
  }
}

}  // namespace
}  // namespace clothfit
