// Checks two driven supports on one rigid body.

#include <gtest/gtest.h>

#include <cmath>

#include "model/integrate/relax.h"
#include "tests/model/cloth_with_effect.h"

namespace clothfit {
namespace {

TEST(RigidSupport, KeepsTheContractOfEffects) {
  expect_effect_contract("rigid_support", {});
}

/// A cloth held at its upper corners, whose motions come closer and part by a tenth while they
/// swing.
struct Pair {
  Cloth cloth = square_cloth(6);
  Eigen::Matrix3Xd start_m = flat_positions(cloth.mesh);

  Pair() {
    for (const int corner : {0, 5}) {
      const Eigen::Vector3d at = start_m.col(corner);
      cloth.held.push_back(held_at(cloth.mesh, at.x(), at.y()));
      const double way = corner == 0 ? 0.05 : -0.05;
      cloth.held.back().motion = [at, way, width_m = cloth.mesh.width_m](double time_s) {
        return Eigen::Vector3d(at + Eigen::Vector3d(way * width_m * std::sin(20 * time_s),
                                                    0.1 * time_s, 0.2 * way * time_s));
      };
    }
  }

  ClothWithEffect with(double share, double slack) const {
    return {cloth, "rigid_support", {share, slack}, start_m};
  }
};

TEST(RigidSupport, KeepsTheDistanceTheMiddleAndTheDirection) {
  const Pair pair;
  const double slack = -0.03, h = 1e-3;
  pair.with(1, slack).after(100, h, [&](int step, const ClothWithEffect::State& state) {
    const Eigen::Vector3d a = pair.cloth.held[0].motion(step * h);
    const Eigen::Vector3d b = pair.cloth.held[1].motion(step * h);
    const Eigen::Vector3d left = state.position_m.col(0), right = state.position_m.col(5);
    EXPECT_NEAR((right - left).norm(), (1 + slack) * pair.cloth.mesh.width_m, 1e-14) << step;
    EXPECT_LT((left + right - a - b).norm(), 1e-14) << step;
    EXPECT_LT((right - left).normalized().cross((b - a).normalized()).norm(), 1e-13) << step;
  });
}

TEST(RigidSupport, KeepsThemFromTheRestBeforeTheStartOn) {
  const Pair pair;
  const double slack = -0.03, start_s = 0.04;  // when they come closer fast
  ClothWithEffect hung = pair.with(1, slack);
  start_at_rest(hung.cloth, {&hung.set, 1}, 9.81, start_s,
                0.9 * stable_rest_step_s(hung.cloth, hung.set));
  const Eigen::Vector3d left = hung.set.start_position_m.col(0);
  const Eigen::Vector3d right = hung.set.start_position_m.col(5);
  EXPECT_NEAR((right - left).norm(), (1 + slack) * pair.cloth.mesh.width_m, 1e-14);
  EXPECT_LT((left + right - pair.cloth.held[0].motion(start_s) - pair.cloth.held[1].motion(start_s))
                .norm(),
            1e-14);
}

TEST(RigidSupport, GoesAShareOfTheWay) {
  const Pair pair;
  const double h = 1e-3;
  const auto left_after = [&](double share) {
    return Eigen::Vector3d(pair.with(share, 0).after(30, h).position_m.col(0));
  };
  EXPECT_LT((left_after(0.3) - 0.7 * left_after(0) - 0.3 * left_after(1)).norm(), 1e-14);
  EXPECT_GT((left_after(1) - left_after(0)).norm(), 1e-3);
}

TEST(RigidSupport, IsOfExactlyTwoDrivenPoints) {
  const Pair pair;
  for (const int driven : {1, 3}) {
    Cloth cloth = pair.cloth;
    if (driven == 1) cloth.held.pop_back();
    if (driven == 3) {
      cloth.held.push_back(held_at(cloth.mesh, 0, cloth.mesh.height_m));
      cloth.held.back().motion = [at = Eigen::Vector3d(pair.start_m.col(30))](double) {
        return at;
      };
    }
    // Nor is it of a point that a fit holds at its start by a motion that stands still.
    if (driven == 3) {
      Cloth resting = cloth;
      resting.held.back().rests = true;
      const ClothWithEffect two(resting, "rigid_support", {1, 0}, pair.start_m);
      const ClothWithEffect none(resting, "rigid_support", {0, 0}, pair.start_m);
      EXPECT_NE(two.after(30, 1e-3).position_m, none.after(30, 1e-3).position_m);
    }
    const ClothWithEffect bound(cloth, "rigid_support", {1, 0}, pair.start_m);
    const ClothWithEffect free(cloth, "rigid_support", {0, 0}, pair.start_m);
    EXPECT_EQ(bound.after(30, 1e-3).position_m, free.after(30, 1e-3).position_m) << driven;
  }
}

}  // namespace
}  // namespace clothfit
