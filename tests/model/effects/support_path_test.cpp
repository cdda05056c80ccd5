// Checks supports that move along a smooth free path.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/model/cloth_with_effect.h"

namespace clothfit {
namespace {

constexpr double kFrom_s = 0.1, kUntil_s = 0.5;

/// Returns where the path is at its knots, beginning with nothing (m).
Eigen::Matrix<double, 3, 5> knots_m() {
  Eigen::Matrix<double, 3, 5> knots;
  knots << 0, 0.01, 0.03, 0.02, 0.04,  //
      0, -0.02, -0.01, 0.03, 0.03,     //
      0, 0.005, 0.01, 0.015, 0.02;
  return knots;
}

std::vector<double> path_to(const Eigen::Matrix<double, 3, 5>& knots, double from_s, double until_s,
                            double point = 0) {
  std::vector<double> parameters(knots.data() + 3, knots.data() + knots.size());
  parameters.insert(parameters.end(), {from_s, until_s, point});
  return parameters;
}

/// Returns places of both upper corners beside the start after each step of `h`, 3 x steps each.
std::array<Eigen::Matrix3Xd, 2> ways_m(const std::vector<double>& parameters, int steps, double h) {
  Cloth bare = square_cloth(5);
  bare.held = {held_at(bare.mesh, 0, 0), held_at(bare.mesh, 0.4, 0)};
  const Eigen::Matrix3Xd start = flat_positions(bare.mesh);
  std::array<Eigen::Matrix3Xd, 2> ways{Eigen::Matrix3Xd(3, steps), Eigen::Matrix3Xd(3, steps)};
  ClothWithEffect(bare, "support_path", parameters, start)
      .after(steps, h, [&](int step, const ClothWithEffect::State& state) {
        ways[0].col(step - 1) = state.position_m.col(0) - start.col(0);
        ways[1].col(step - 1) = state.position_m.col(4) - start.col(4);
      });
  return ways;
}

TEST(SupportPath, KeepsTheContractOfEffects) {
  expect_effect_contract("support_path", {});
}

TEST(SupportPath, RestsThenGoesThroughItsKnotsAndStays) {
  const double h = 1e-3;
  const Eigen::Matrix<double, 3, 5> knots = knots_m();

  for (const Eigen::Matrix3Xd& way : ways_m(path_to(knots, kFrom_s, kUntil_s), 700, h)) {
    EXPECT_EQ(way.leftCols(100), Eigen::Matrix3Xd::Zero(3, 100));  // up to 0.1 s
    for (int k = 1; k < 5; ++k)
      EXPECT_LT((way.col(100 + 100 * k - 1) - knots.col(k)).norm(), 1e-14) << k;
    EXPECT_LT((way.rightCols(200).colwise() - knots.col(4)).cwiseAbs().maxCoeff(), 1e-14);
  }
}

TEST(SupportPath, KeepsBetweenItsKnotsAndItsVelocityHasNoJumps) {
  const double h = 1e-3;
  const Eigen::Matrix<double, 3, 5> knots = knots_m();
  const Eigen::Matrix3Xd way = ways_m(path_to(knots, kFrom_s, kUntil_s), 600, h)[0];

  for (int step = 101; step <= 500; ++step) {
    const int k = std::min((step - 101) / 100, 3);
    const Eigen::Vector3d low = knots.col(k).cwiseMin(knots.col(k + 1));
    const Eigen::Vector3d high = knots.col(k).cwiseMax(knots.col(k + 1));
    EXPECT_GE((way.col(step - 1) - low).minCoeff(), -1e-15) << step;
    EXPECT_LE((way.col(step - 1) - high).maxCoeff(), 1e-15) << step;
  }
  // S bends by 6 at most, in units of a knot's distance, 0.04 m, over the square of 0.1 s.
  const Eigen::Matrix3Xd second =
      way.rightCols(598) - 2 * way.middleCols(1, 598) + way.leftCols(598);
  EXPECT_LT(second.cwiseAbs().maxCoeff(), 1.01 * 6 * 0.04 / 0.01 * h * h);
}

TEST(SupportPath, OfASinglePointLeavesTheOtherWhereItIs) {
  const auto ways = ways_m(path_to(knots_m(), 0, kUntil_s, 2), 600, 1e-3);

  EXPECT_EQ(ways[0], Eigen::Matrix3Xd::Zero(3, 600));
  EXPECT_LT((ways[1].rightCols(1) - knots_m().col(4)).norm(), 1e-14);
}

}  // namespace
}  // namespace clothfit
