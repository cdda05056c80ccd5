// Checks supports that move once and stay.

#include <gtest/gtest.h>

#include <array>

#include "tests/model/cloth_with_effect.h"

namespace clothfit {
namespace {

const Eigen::Vector3d kMovesBy_m(0.02, -0.01, 0.03);
constexpr double kMovesFrom_s = 0.1, kMoveLasts_s = 0.4;

/// Returns places of both upper corners beside the start after each step of 1 ms, 3 x steps each.
std::array<Eigen::Matrix3Xd, 2> once_moved_m(double point, int steps) {
  Cloth bare = square_cloth(5);
  bare.held = {held_at(bare.mesh, 0, 0), held_at(bare.mesh, 0.4, 0)};
  const Eigen::Matrix3Xd start = flat_positions(bare.mesh);
  std::array<Eigen::Matrix3Xd, 2> ways{Eigen::Matrix3Xd(3, steps), Eigen::Matrix3Xd(3, steps)};
  ClothWithEffect(
      bare, "support_move",
      {kMovesBy_m.x(), kMovesBy_m.y(), kMovesBy_m.z(), kMovesFrom_s, kMoveLasts_s, point}, start)
      .after(steps, 1e-3, [&](int step, const ClothWithEffect::State& state) {
        ways[0].col(step - 1) = state.position_m.col(0) - start.col(0);
        ways[1].col(step - 1) = state.position_m.col(4) - start.col(4);
      });
  return ways;
}

TEST(SupportMove, KeepsTheContractOfEffects) {
  expect_effect_contract("support_move", {});
}

TEST(SupportMove, RestsMovesOnceAndStays) {
  for (const Eigen::Matrix3Xd& way : once_moved_m(0, 700)) {
    EXPECT_EQ(way.leftCols(100), Eigen::Matrix3Xd::Zero(3, 100));  // up to 0.1 s
    EXPECT_LT((way.col(299) - 0.5 * kMovesBy_m).norm(), 1e-14);
    EXPECT_LT((way.rightCols(200).colwise() - kMovesBy_m).cwiseAbs().maxCoeff(), 1e-14);
    const Eigen::Matrix3Xd per_step = way.rightCols(699) - way.leftCols(699);
    // Differences over 1 ms fall short of the largest velocity by 1e-5 of it.
    EXPECT_NEAR(per_step.colwise().norm().maxCoeff(), 1.5 * kMovesBy_m.norm() / kMoveLasts_s * 1e-3,
                3e-9);
  }
}

TEST(SupportMove, OfASinglePointLeavesTheOtherWhereItIs) {
  const auto ways = once_moved_m(2, 600);

  EXPECT_EQ(ways[0], Eigen::Matrix3Xd::Zero(3, 600));
  EXPECT_LT((ways[1].rightCols(1) - kMovesBy_m).norm(), 1e-14);
}

}  // namespace
}  // namespace clothfit
