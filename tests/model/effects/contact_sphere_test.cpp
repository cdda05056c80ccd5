// Checks contact with a ball. Not checked here: friction and damping (contact_plane_test.cpp).

#include <gtest/gtest.h>

#include "tests/model/cloth_with_effect.h"

namespace clothfit {
namespace {

TEST(ContactSphere, KeepsTheContractOfEffects) {
  expect_effect_contract("contact_sphere", {});
}

TEST(ContactSphere, PushesWhatIsInsideOutAlongItsRadii) {
  const Eigen::Vector3d centre(0.15, 0.2, -0.05);
  const double radius = 0.18, stiffness = 2500;
  Uniform uniform(1);
  const Cloth bare = square_cloth(6);
  const Eigen::Matrix3Xd p = crumpled(bare.mesh, 0.4, uniform);
  const ClothWithEffect cloth(bare, "contact_sphere",
                              {stiffness, 0, 0, centre.x(), centre.y(), centre.z(), radius}, p);
  const Eigen::VectorXd area_m2 = masses_by_area(bare.mesh, 0.16);

  const Eigen::Matrix3Xd force = cloth.force_n(p, at_rest(p));

  int inside = 0;
  for (int k = 0; k < 36; ++k) {
    const Eigen::Vector3d from = p.col(k) - centre;
    const double depth = std::max(0.0, radius - from.norm());
    inside += depth > 0;
    EXPECT_LT((force.col(k) - stiffness * area_m2[k] * depth * from.normalized()).norm(), 1e-14);
  }
  EXPECT_GT(inside, 5);
  EXPECT_LT(inside, 31);
}

TEST(ContactSphere, ASheetDroppedOnItsTopDrapesSymmetrically) {
  const Cloth bare = square_cloth(9);
  const Eigen::Matrix3Xd start = flat_positions(bare.mesh);
  ClothWithEffect sheet(bare, "contact_sphere", {5000, 2, 0.3, 0.2, 0.2, -0.151, 0.15}, start);
  sheet.set.springs.stiffness_n_per_m[structural_s] =
      sheet.set.springs.stiffness_n_per_m[structural_t];

  const Eigen::Matrix3Xd p = sheet.after(2500, 1e-4).position_m;

  // It hangs over by its corners and rests on its middle.
  EXPECT_NEAR(p(2, 40), 0, 5e-3);
  EXPECT_LT(p(2, 0), -0.1);
  double lopsided_m = 0;
  for (int i = 0; i < 9; ++i) {
    for (int j = 0; j < 9; ++j) {
      const Eigen::Vector3d here = p.col(bare.mesh.vertex(i, j));
      const Eigen::Vector3d across = p.col(bare.mesh.vertex(i, 8 - j));
      const Eigen::Vector3d mirrored(0.4 - across.x(), across.y(), across.z());
      lopsided_m = std::max(lopsided_m, (here - mirrored).norm());
    }
  }
  // The tolerance is rounding, which buckling may enlarge.
  EXPECT_LT(lopsided_m, 1e-7);
}

TEST(ContactSphere, TakesUpTheWeightOfWhatComesToRestOnIt) {
  // A small sheet lies on a large ball: the ball's push must carry its weight.
  const Mesh mesh{.columns = 5, .rows = 5, .width_m = 0.1, .height_m = 0.1};
  const Cloth bare = Cloth::of(mesh, masses_by_area(mesh, 0.002));
  Eigen::Matrix3Xd start = flat_positions(mesh);
  start.topRows<2>().array() -= 0.05;
  ClothWithEffect sheet(bare, "contact_sphere", {3000, 50, 1, 0, 0, -1, 1}, start);

  const auto rest = sheet.after(20000, 2e-4);

  const Eigen::Vector3d force =
      sheet.force_n(rest.position_m, rest.velocity_m_per_s).rowwise().sum();
  EXPECT_NEAR(force.z(), 0.002 * 9.81, 1e-6);
  EXPECT_LT(force.head<2>().norm(), 1e-6);
}

TEST(ContactSphere, WhatItsForceAddsUpToIsTheMomentumThatTheSheetTakesUp) {
  const Cloth bare = square_cloth(7);
  ClothWithEffect sheet(bare, "contact_sphere", {4000, 1, 0.4, 0.17, 0.22, -0.12, 0.1},
                        flat_positions(bare.mesh));
  sheet.set.gravity_m_per_s2.setZero();
  sheet.set.start_velocity_m_per_s = Eigen::Vector3d(0.3, 0, -1).replicate(1, 49);
  const double h = 1e-4;
  Eigen::Vector3d momentum = momentum_kg_m_per_s(bare.mass_kg, sheet.set.start_velocity_m_per_s);
  const Eigen::Vector3d before = momentum;

  Eigen::Matrix3Xd p = sheet.set.start_position_m, v = sheet.set.start_velocity_m_per_s;
  const auto end = sheet.after(1500, h, [&](int, const ClothWithEffect::State& state) {
    momentum += h * sheet.force_n(p, v).rowwise().sum();
    p = state.position_m;
    v = state.velocity_m_per_s;
  });

  EXPECT_GT((momentum - before).norm(), 1e-3);
  EXPECT_LT((momentum_kg_m_per_s(bare.mass_kg, end.velocity_m_per_s) - momentum).norm(), 1e-14);
}

}  // namespace
}  // namespace clothfit
