// Checks gravity in another direction.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/model/cloth_with_effect.h"

namespace clothfit {
namespace {

Eigen::Vector3d tilted(const Eigen::Vector3d& gravity, double about_x, double about_y) {
  const Cloth bare = square_cloth(3);
  ClothWithEffect cloth(bare, "gravity_tilt", {about_x, about_y}, flat_positions(bare.mesh));
  cloth.set.gravity_m_per_s2 = gravity;
  const double h = 1e-3;
  const Eigen::Matrix3Xd v = cloth.after(1, h).velocity_m_per_s;
  EXPECT_LT((v.colwise() - v.col(0)).cwiseAbs().maxCoeff(), 1e-14);  // the springs' rounding
  return v.col(0) / h;
}

TEST(GravityTilt, KeepsTheContractOfEffects) {
  expect_effect_contract("gravity_tilt", {});
}

TEST(GravityTilt, TurnsGravityByItsAnglesAndLeavesItsSize) {
  for (const auto& [a, b] : {std::pair{0.02, 0.0}, {0.0, -0.03}, {0.2, 0.25}}) {
    SCOPED_TRACE(testing::Message() << a << ", " << b);
    const Eigen::Vector3d g(0.4, -0.2, -9.7);
    // The rational rotation turns by 2 atan(angle / 2) about its axis.
    const double angle = std::hypot(a, b);
    const Eigen::Vector3d expected =
        Eigen::AngleAxisd(2 * std::atan(angle / 2), Eigen::Vector3d(a, b, 0) / angle) * g;

    const Eigen::Vector3d seen = tilted(g, a, b);

    EXPECT_LT((seen - expected).norm(), 1e-11);
    EXPECT_NEAR(seen.norm(), g.norm(), 1e-11);
  }
}

TEST(GravityTilt, PositiveAnglesTurnByTheRightHand) {
  const Eigen::Vector3d down(0, 0, -9.81);

  EXPECT_GT(tilted(down, 0.1, 0).y(), 0.9);
  EXPECT_LT(tilted(down, 0, 0.1).x(), -0.9);
}

}  // namespace
}  // namespace clothfit
