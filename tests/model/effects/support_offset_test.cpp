// Checks supports beside the places of their motion.

#include <gtest/gtest.h>

#include "model/integrate/relax.h"
#include "tests/model/cloth_with_effect.h"

namespace clothfit {
namespace {

const Eigen::Vector3d kOffset_m(0.012, -0.02, 0.015);

TEST(SupportOffset, KeepsTheContractOfEffects) {
  expect_effect_contract("support_offset", {});
}

/// Holds two corners, one of which swings along x.
Cloth half_driven() {
  Cloth cloth = square_cloth(6);
  const Eigen::Matrix3Xd start = flat_positions(cloth.mesh);
  const Eigen::Vector3d corner = start.col(5);
  cloth.held = {held_at(cloth.mesh, 0, 0), held_at(cloth.mesh, cloth.mesh.width_m, 0)};
  cloth.held[1].motion = [corner](double time_s) -> Eigen::Vector3d {
    return corner + Eigen::Vector3d(0.05 * std::sin(3 * time_s), 0, 0);
  };
  return cloth;
}

TEST(SupportOffset, ShiftsWhatIsDrivenAndLeavesWhatRests) {
  const Cloth bare = half_driven();
  const Eigen::Matrix3Xd start = flat_positions(bare.mesh);
  const double h = 1e-3;
  ClothWithEffect(bare, "support_offset", {kOffset_m.x(), kOffset_m.y(), kOffset_m.z(), 0}, start)
      .after(100, h, [&](int step, const ClothWithEffect::State& state) {
        EXPECT_LT((state.position_m.col(0) - start.col(0)).norm(), 1e-14) << step;
        EXPECT_LT((state.position_m.col(5) - bare.held[1].motion(step * h) - kOffset_m).norm(),
                  1e-14)
            << step;
      });
}

TEST(SupportOffset, OfASinglePointLeavesTheOtherWhereItsMotionHasIt) {
  Cloth bare = half_driven();
  const Eigen::Matrix3Xd start = flat_positions(bare.mesh);
  const Eigen::Vector3d corner = start.col(0);
  bare.held[0].motion = [corner](double) { return corner; };
  const double h = 1e-3;
  ClothWithEffect(bare, "support_offset", {kOffset_m.x(), kOffset_m.y(), kOffset_m.z(), 1}, start)
      .after(100, h, [&](int step, const ClothWithEffect::State& state) {
        EXPECT_LT((state.position_m.col(0) - corner - kOffset_m).norm(), 1e-14) << step;
        EXPECT_LT((state.position_m.col(5) - bare.held[1].motion(step * h)).norm(), 1e-14) << step;
      });
}

TEST(SupportOffset, IsAMotionThatIsElsewhereFromTheRestBeforeTheStartOn) {
  // Where all held points are driven, shifting them shifts the cloth: at rest and ever after.
  Cloth bare = square_cloth(6);
  Eigen::Matrix3Xd start = flat_positions(bare.mesh);
  start.row(2) = -start.row(1);  // hanging
  start.row(1).setZero();
  Cloth elsewhere = bare;
  for (const int corner : {0, 5}) {
    const Eigen::Vector3d at = start.col(corner);
    const auto way = [](double time_s) {
      return Eigen::Vector3d(0.05 * std::sin(3 * time_s), 0.02 * time_s, 0);
    };
    const double s = corner == 0 ? 0 : bare.mesh.width_m;
    bare.held.push_back(held_at(bare.mesh, s, 0));
    bare.held.back().motion = [=](double time_s) -> Eigen::Vector3d { return at + way(time_s); };
    elsewhere.held.push_back(held_at(bare.mesh, s, 0));
    elsewhere.held.back().motion = [=](double time_s) -> Eigen::Vector3d {
      return at + way(time_s) + kOffset_m;
    };
  }
  ClothWithEffect offset(bare, "support_offset", {kOffset_m.x(), kOffset_m.y(), kOffset_m.z(), 0},
                         start);
  ClothWithEffect neutral(elsewhere, "support_offset", {0, 0, 0, 0}, start);
  for (ClothWithEffect* cloth : {&offset, &neutral}) {
    const double rest_s = 0.9 * stable_rest_step_s(cloth->cloth, cloth->set);
    start_at_rest(cloth->cloth, {&cloth->set, 1}, 9.81, 0, rest_s);
  }
  // The held points glide to their places in one and jump the last 28 mm in the other. A twentieth
  // of that remains, as the relaxation leaves a little of everything.
  const Eigen::Matrix3Xd& rest = offset.set.start_position_m;
  EXPECT_LT((rest - neutral.set.start_position_m).colwise().norm().maxCoeff(),
            0.05 * kOffset_m.norm());
  EXPECT_LT((rest.col(0) - start.col(0) - kOffset_m).norm(), 1e-14);

  neutral.set = offset.set;
  neutral.set.effects = {{0, 0, 0, 0}};
  const double h = 2e-4;
  EXPECT_LT(
      (offset.after(1500, h).position_m - neutral.after(1500, h).position_m).cwiseAbs().maxCoeff(),
      1e-9);
}

}  // namespace
}  // namespace clothfit
