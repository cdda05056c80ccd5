// Checks the inertia of air along the surface's normal.

#include <gtest/gtest.h>

#include "model/effects/registry.h"
#include "tests/model/cloth_with_effect.h"

namespace clothfit {
namespace {

ClothWithEffect in_air(double mu_kg_per_m2, const Eigen::Matrix3d& attitude) {
  const Cloth bare = square_cloth(5);
  return {bare, "added_air_mass", {mu_kg_per_m2}, attitude * flat_positions(bare.mesh)};
}

TEST(AddedAirMass, KeepsTheContractOfEffects) {
  expect_effect_contract("added_air_mass", {});
}

TEST(AddedAirMass, SlowsASheetThatFallsFlatAndNoneThatFallsEdgeOn) {
  const double mu = 0.1, h = 1e-3;
  const double slowed =
      -9.81 * kSquareClothDensity_kg_per_m2 / (kSquareClothDensity_kg_per_m2 + mu);

  const auto flat = in_air(mu, lying()).after(400, h);
  const auto edge_on = in_air(mu, upright()).after(400, h);

  EXPECT_LT(
      (flat.velocity_m_per_s.colwise() - Eigen::Vector3d(0, 0, 0.4 * slowed)).cwiseAbs().maxCoeff(),
      1e-11);
  EXPECT_LT((edge_on.velocity_m_per_s.colwise() - Eigen::Vector3d(0, 0, -0.4 * 9.81))
                .cwiseAbs()
                .maxCoeff(),
            1e-11);
}

TEST(AddedAirMass, MakesATiltedSheetGlide) {
  // With n . a = g m cos / (m + mu A), across the normal g sin, it slides sideways as it falls.
  const double mu = 0.1;
  const Eigen::Matrix3d tilt = Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitY()).toRotationMatrix();
  const Eigen::Vector3d n = tilt.col(2), g(0, 0, -9.81);
  const Eigen::Vector3d expected =
      0.2 * (g - mu / (kSquareClothDensity_kg_per_m2 + mu) * n.dot(g) * n);

  const auto state = in_air(mu, tilt).after(200, 1e-3);

  EXPECT_GT(std::abs(expected.x()), 0.1);
  EXPECT_LT((state.velocity_m_per_s.colwise() - expected).cwiseAbs().maxCoeff(), 1e-11);
}

TEST(AddedAirMass, KeepsTheMomentumOfClothAndAirThatNothingActsOn) {
  // A flat sheet ripples along its normal: springs pull along the sheet and, to first order, across
  // it. In a sheet whose normals stay put the momentum is (m + mu A) v along n and m v across.
  const double mu = 0.1, h = 2e-4;
  ClothWithEffect sheet = in_air(mu, lying());
  sheet.set.gravity_m_per_s2.setZero();
  Uniform uniform(1);
  // Vertices are moved in the plane only, so that the normals are e_z; all of it moves along e_z.
  sheet.set.start_velocity_m_per_s = uniform.vectors(25, 0.3);
  sheet.set.start_velocity_m_per_s.row(2).setConstant(0.7);
  const Eigen::Vector3d before =
      momentum_kg_m_per_s(sheet.cloth.mass_kg, sheet.set.start_velocity_m_per_s);

  const auto state = sheet.after(500, h);

  EXPECT_GT((state.velocity_m_per_s - sheet.set.start_velocity_m_per_s).norm(), 0.1);
  EXPECT_LT((momentum_kg_m_per_s(sheet.cloth.mass_kg, state.velocity_m_per_s) - before).norm(),
            1e-14);
}

TEST(AddedAirMass, DividesAForceAlongTheNormalByBothMasses) {
  // F' / m = F / (m + mu A) holds for a force along the normal, whatever gravity does beside it.
  const double mu = 0.3;
  ClothWithEffect sheet = in_air(mu, lying());
  add_effect(sheet.cloth, "wind", "test");
  sheet.set.effects.push_back({0, 0, 0, 0.8});
  sheet.set.gravity_m_per_s2.setZero();

  const auto state = sheet.after(100, 1e-3);

  const double expected = 0.1 * 0.8 / (kSquareClothDensity_kg_per_m2 + mu);
  EXPECT_LT(
      (state.velocity_m_per_s.colwise() - Eigen::Vector3d(0, 0, expected)).cwiseAbs().maxCoeff(),
      1e-12);
}

}  // namespace
}  // namespace clothfit
