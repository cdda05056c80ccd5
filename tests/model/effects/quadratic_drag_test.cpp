// Checks drag with the square of the speed.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/model/cloth_with_effect.h"

namespace clothfit {
namespace {

ClothWithEffect falling(int vertices_per_side, double c_n, double c_t,
                        const Eigen::Matrix3d& attitude) {
  const Cloth bare = square_cloth(vertices_per_side);
  return {bare, "quadratic_drag", {c_n, c_t}, attitude * flat_positions(bare.mesh)};
}

TEST(QuadraticDrag, KeepsTheContractOfEffects) {
  expect_effect_contract("quadratic_drag", {.isotropic = true, .only_damps = true});
}

TEST(QuadraticDrag, AFallingSheetComesToTheSpeedAtWhichDragCarriesIt) {
  // At the end c v^2 A / 2 = m g, lying flat by normal drag, edge-on by tangential drag, on any
  // mesh.
  const double c = 1.2;
  const Eigen::Vector3d expected(0, 0, -std::sqrt(2 * 9.81 * kSquareClothDensity_kg_per_m2 / c));
  for (const int vertices : {2, 5}) {
    SCOPED_TRACE(vertices);

    // The speed's distance from its end falls as e^(-2 g t / v): 10 s are 120 time constants.
    const auto lying_flat = falling(vertices, c, 0, lying()).after(10000, 1e-3);
    const auto edge_on = falling(vertices, 0, c, upright()).after(10000, 1e-3);

    EXPECT_LT((lying_flat.velocity_m_per_s.colwise() - expected).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_LT((edge_on.velocity_m_per_s.colwise() - expected).cwiseAbs().maxCoeff(), 1e-12);
  }
}

TEST(QuadraticDrag, EachDirectionHasItsOwnCoefficient) {
  const Eigen::Vector3d free_fall(0, 0, -9.81 * 0.5);

  const auto lying_flat = falling(4, 0, 2, lying()).after(500, 1e-3);
  const auto edge_on = falling(4, 3, 0, upright()).after(500, 1e-3);

  EXPECT_LT((lying_flat.velocity_m_per_s.colwise() - free_fall).cwiseAbs().maxCoeff(), 1e-11);
  EXPECT_LT((edge_on.velocity_m_per_s.colwise() - free_fall).cwiseAbs().maxCoeff(), 1e-11);
}

TEST(QuadraticDrag, GrowsWithTheSquareOfTheSpeedAgainstIt) {
  Uniform uniform(3);
  const ClothWithEffect sheet = falling(6, 0.7, 0.2, lying());
  const Eigen::Matrix3Xd p = crumpled(sheet.cloth.mesh, 0.5, uniform);
  const Eigen::Matrix3Xd v = uniform.vectors(36, 2);

  const Eigen::Matrix3Xd force = sheet.force_n(p, v);

  EXPECT_GT(force.norm(), 0);
  EXPECT_LT((sheet.force_n(p, -3 * v) + 9 * force).norm(), 1e-13 * force.norm());
}

}  // namespace
}  // namespace clothfit
