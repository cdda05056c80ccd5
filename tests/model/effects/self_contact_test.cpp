// Checks contact of the cloth with itself. Not checked here: the search for pairs
// (near_pairs_test.cpp).

#include <gtest/gtest.h>

#include <numbers>

#include "model/effects/registry.h"
#include "tests/model/cloth_with_effect.h"

namespace clothfit {
namespace {

TEST(SelfContact, KeepsTheContractOfEffects) {
  expect_effect_contract("self_contact",
                         {.isotropic = true, .proportional = true, .internal = true});
}

TEST(SelfContact, ParallelSheetsPressEachOtherApartWithTheIntegralOverBoth) {
  // The pressure tends to p = pi k z (d - z)^2 / d^2, far from edges and from the fold, as the mesh
  // gets finer.
  const double stiffness = 2000, d = 0.05;
  for (const double z : {0.01, 0.02, 0.035}) {
    double before = INFINITY;
    for (const int vertices : {21, 81}) {
      SCOPED_TRACE(testing::Message() << "gap " << z << ", " << vertices);
      const Cloth bare = square_cloth(vertices);
      const Eigen::Matrix3Xd p = folded(bare.mesh, z);
      const ClothWithEffect sheet(bare, "self_contact", {stiffness, d}, p);

      const Eigen::Matrix3Xd force = sheet.force_n(p, at_rest(p));

      // At s = 0.1 m and t = 0.2 m the fold is as far as the edges.
      const int k = bare.mesh.vertex((vertices - 1) / 2, (vertices - 1) / 4);
      const double cell_m2 = bare.mesh.spacing_s_m() * bare.mesh.spacing_t_m();
      const double expected = std::numbers::pi * stiffness * z * (d - z) * (d - z) / (d * d);
      const double error = std::abs(-force(2, k) / cell_m2 / expected - 1);
      EXPECT_LT(error, vertices == 21 ? 0.3 : 0.01);
      EXPECT_LT(error, before);
      before = error;
      EXPECT_LT(force.col(k).head<2>().norm(), 1e-12 * force.norm());
    }
  }
}

TEST(SelfContact, FlatClothDoesNotFeelItWhateverTheThickness) {
  for (const double thickness : {0.02, 0.08, 0.1}) {
    const Cloth bare = square_cloth(17);
    const Eigen::Matrix3Xd p = flat_positions(bare.mesh);

    EXPECT_EQ(
        ClothWithEffect(bare, "self_contact", {2000, thickness}, p).force_n(p, at_rest(p)).norm(),
        0)
        << thickness;
  }
}

TEST(SelfContact, KeepsMomentumAndAngularMomentum) {
  Uniform uniform(2);
  const Cloth bare = square_cloth(9);
  ClothWithEffect sheet(bare, "self_contact", {5000, 0.06}, folded(bare.mesh, 0.05));
  sheet.set.gravity_m_per_s2.setZero();
  // The upper layer comes down.
  sheet.set.start_velocity_m_per_s = uniform.vectors(81, 0.1);
  for (int k = 0; k < 81; ++k)
    if (sheet.set.start_position_m(2, k) > 0.04) sheet.set.start_velocity_m_per_s(2, k) -= 1.5;
  const auto momenta = [&](const Eigen::Matrix3Xd& x, const Eigen::Matrix3Xd& v) {
    return std::pair{momentum_kg_m_per_s(bare.mass_kg, v),
                     torque(x, v * bare.mass_kg.asDiagonal())};
  };
  const auto before = momenta(sheet.set.start_position_m, sheet.set.start_velocity_m_per_s);

  const auto end = sheet.after(1000, 1e-4);

  const auto after = momenta(end.position_m, end.velocity_m_per_s);
  EXPECT_GT((end.velocity_m_per_s - sheet.set.start_velocity_m_per_s).norm(), 1);
  EXPECT_LT((after.first - before.first).norm(), 1e-14);
  // Forces act along connections of positions that then move on along the new velocities. The
  // angular momentum of this scheme does not see that.
  EXPECT_LT((after.second - before.second).norm(), 1e-14);
}

TEST(SelfContact, AClothFoldedOnItselfComesToRestOnItself) {
  // Given a cloth whose lower half lies still, and whose upper half falls onto it,
  const auto lowest_gap_m = [](double stiffness) {
    const Mesh mesh{.columns = 11, .rows = 7, .width_m = 0.4, .height_m = 0.24};
    Cloth bare = Cloth::of(mesh, masses_by_area(mesh, 0.015));
    for (int i = 0; i < mesh.rows; ++i)
      for (int j = 0; j <= 5; ++j)
        bare.held.push_back(held_at(mesh, j * mesh.spacing_s_m(), i * mesh.spacing_t_m()));
    ClothWithEffect sheet(bare, "self_contact", {stiffness, 0.045}, folded(mesh, 0.05));
    add_effect(sheet.cloth, "viscous_damping", "test");
    sheet.set.effects.push_back({5});
    double lowest = INFINITY;
    sheet.after(8000, 1e-4, [&](int, const ClothWithEffect::State& state) {
      // The comparison is away from the fold, where the halves are one.
      for (int i = 0; i < mesh.rows; ++i)
        for (int j = 8; j < mesh.columns; ++j)
          lowest = std::min(lowest, state.position_m(2, mesh.vertex(i, j)));
    });
    return lowest;
  };

  // when there is contact it stays above, without it falls through.
  EXPECT_GT(lowest_gap_m(4000), 0.005);
  EXPECT_LT(lowest_gap_m(0), -0.05);
}

}  // namespace
}  // namespace clothfit
