// Checks mass that is not spread as stated.

#include <gtest/gtest.h>

#include <numbers>

#include "tests/model/cloth_with_effect.h"

namespace clothfit {
namespace {

constexpr double kUniformMass_kg = 0.025, kSide_m = 0.4;  // those of square_cloth

struct Masses {
  double hem = 0, hem_width = 0.01, hem_left = 0, hem_right = 0, hem_top = 0, hem_bottom = 0,
         gradient_s = 0, gradient_t = 0, patch = 0, patch_s = 0.5, patch_t = 0.5,
         patch_radius = 0.1;
  std::vector<double> values() const {
    return {hem,        hem_width,  hem_left, hem_right, hem_top, hem_bottom,
            gradient_s, gradient_t, patch,    patch_s,   patch_t, patch_radius};
  }
};

ClothWithEffect with(int vertices_per_side, const Masses& masses) {
  const Cloth bare = square_cloth(vertices_per_side);
  return {bare, "nonuniform_mass", masses.values(), flat_positions(bare.mesh)};
}

/// Returns the masses (kg) that accelerate as if they were the vertices', from the change of a
/// force.
Eigen::VectorXd true_mass_kg(const ClothWithEffect& cloth) {
  Uniform unused(0);
  effect_contract::State state(unused);
  state.cloth = cloth.cloth;
  state.position_m = cloth.set.start_position_m;
  state.velocity_m_per_s = at_rest(state.position_m);
  const Eigen::Matrix3Xd ones = Eigen::Matrix3Xd::Ones(3, state.position_m.cols());
  return cloth.cloth.mass_kg.cwiseQuotient(
      effect_contract::force_n(*cloth.cloth.effects.front(), state, cloth.set.effects.front(), ones)
          .row(0)
          .transpose());
}

TEST(NonuniformMass, KeepsTheContractOfEffects) {
  expect_effect_contract("nonuniform_mass", {});
}

TEST(NonuniformMass, AHemWeighsTheSameOnEveryMesh) {
  for (const double width_m : {0.007, 0.03}) {
    const double inner_m = kSide_m - 2 * width_m;
    const double band = 1 - inner_m * inner_m / (kSide_m * kSide_m);
    for (const int vertices : {2, 6, 17}) {
      SCOPED_TRACE(testing::Message() << width_m << " m, " << vertices);

      const Eigen::VectorXd mass = true_mass_kg(with(vertices, {.hem = 1.5, .hem_width = width_m}));

      EXPECT_NEAR(mass.sum(), kUniformMass_kg * (1 + 1.5 * band), 1e-15);
      EXPECT_GT(mass[0] / with(vertices, {}).cloth.mass_kg[0], 1.01);
    }
  }
}

// Vertices carry their hat functions' parts of the cloth. These add up to any constant or linear
// function over it. An edge therefore weighs, and lies, as the band itself, also where the mesh is
// coarser than the band is wide.
TEST(NonuniformMass, AHeavyEdgeWeighsTheSameAndLiesAtTheSamePlaceOnEveryMesh) {
  for (const double width_m : {0.007, 0.03}) {
    const double band_kg = kUniformMass_kg * width_m / kSide_m;
    for (const int vertices : {2, 6, 17}) {
      SCOPED_TRACE(testing::Message() << width_m << " m, " << vertices);
      const Eigen::VectorXd plain = with(vertices, {}).cloth.mass_kg;
      const Eigen::Matrix3Xd flat_m = with(vertices, {}).set.start_position_m;
      const Eigen::VectorXd from_left_m = flat_m.row(0).transpose(),
                            from_top_m = flat_m.row(1).transpose();
      const Eigen::VectorXd from_right_m = kSide_m - from_left_m.array(),
                            from_bottom_m = kSide_m - from_top_m.array();
      const auto expect_band = [&](Masses masses, const Eigen::VectorXd& from_edge_m,
                                   const Eigen::VectorXd& along_edge_m) {
        masses.hem_width = width_m;
        const Eigen::VectorXd more = true_mass_kg(with(vertices, masses)) - plain;
        EXPECT_NEAR(more.sum(), 2 * band_kg, 1e-15);
        EXPECT_NEAR(more.dot(from_edge_m), 2 * band_kg * width_m / 2, 1e-15);
        EXPECT_NEAR(more.dot(along_edge_m), 2 * band_kg * kSide_m / 2, 1e-15);
      };

      expect_band({.hem_left = 2}, from_left_m, from_top_m);
      expect_band({.hem_right = 2}, from_right_m, from_top_m);
      expect_band({.hem_top = 2}, from_top_m, from_left_m);
      expect_band({.hem_bottom = 2}, from_bottom_m, from_left_m);
    }
  }
}

// On a mesh of 2 x 2 every vertex carries some of every edge: its hat function reaches all of them.
TEST(NonuniformMass, AHeavyEdgeIsCarriedByTheVerticesNearIt) {
  for (const int vertices : {3, 6, 17}) {
    SCOPED_TRACE(vertices);
    const Eigen::VectorXd plain = with(vertices, {}).cloth.mass_kg;
    const auto heavier_kg = [&](const Masses& masses, int row, int column) {
      const Eigen::VectorXd more = true_mass_kg(with(vertices, masses)) - plain;
      return more[row * vertices + column];
    };
    const int last = vertices - 1, middle = vertices / 2;

    EXPECT_GT(heavier_kg({.hem_left = 2}, middle, 0), 0);
    EXPECT_GT(heavier_kg({.hem_right = 2}, middle, last), 0);
    EXPECT_GT(heavier_kg({.hem_top = 2}, 0, middle), 0);
    EXPECT_GT(heavier_kg({.hem_bottom = 2}, last, middle), 0);
    EXPECT_EQ(heavier_kg({.hem_left = 2}, middle, last), 0);
    EXPECT_EQ(heavier_kg({.hem_bottom = 2}, 0, middle), 0);
  }
}

TEST(NonuniformMass, GradientsShiftTheCentreOfMassAndKeepTheSum) {
  const ClothWithEffect cloth = with(9, {.gradient_s = 0.4, .gradient_t = -0.2});

  const Eigen::VectorXd mass = true_mass_kg(cloth);

  EXPECT_NEAR(mass.sum(), kUniformMass_kg, 1e-15);
  // For a side with unit density and slope, int x (x - 1/2) = 1/12. Trapezoids on 8 intervals give
  // 1/12 (1 + 2 / 64).
  const Eigen::Vector3d centre = cloth.set.start_position_m * mass / kUniformMass_kg;
  EXPECT_NEAR(centre.x() / kSide_m - 0.5, 0.4 / 12 * (1 + 2.0 / 64), 1e-14);
  EXPECT_NEAR(centre.y() / kSide_m - 0.5, -0.2 / 12 * (1 + 2.0 / 64), 1e-14);
}

TEST(NonuniformMass, APatchWeighsAQuarterOfItsDisc) {
  // The patch's integral is int (1 - u^2)^3 dA = pi R^2 / 4.
  const Masses patch{.patch = 0.8, .patch_s = 0.55, .patch_t = 0.4, .patch_radius = 0.12};

  const double added = true_mass_kg(with(65, patch)).sum() - kUniformMass_kg;

  const double expected =
      0.8 * kUniformMass_kg / (kSide_m * kSide_m) * std::numbers::pi * 0.12 * 0.12 / 4;
  EXPECT_NEAR(added, expected, 1e-5 * expected);  // 19 spacings to a radius
}

TEST(NonuniformMass, FreeFallDoesNotFeelIt) {
  const auto state = with(5, {.hem = 2, .gradient_s = 0.5, .patch = 1}).after(200, 1e-3);

  EXPECT_LT(
      (state.velocity_m_per_s.colwise() - Eigen::Vector3d(0, 0, -0.2 * 9.81)).cwiseAbs().maxCoeff(),
      1e-13);
}

TEST(NonuniformMass, KeepsTheMomentumOfTheTrueMasses) {
  for (const unsigned seed : {1u, 2u}) {
    SCOPED_TRACE(seed);
    Uniform uniform(seed);
    ClothWithEffect cloth = with(6, {.hem = 1,
                                     .hem_width = 0.05,
                                     .gradient_s = 0.8,
                                     .gradient_t = -0.5,
                                     .patch = 2,
                                     .patch_radius = 0.2});
    cloth.set.gravity_m_per_s2.setZero();
    cloth.set.start_position_m = crumpled(cloth.cloth.mesh, 0.3, uniform);
    cloth.set.start_velocity_m_per_s = uniform.vectors(36, 1);
    const Eigen::VectorXd mass = true_mass_kg(cloth);

    const Eigen::Matrix3Xd& before = cloth.set.start_velocity_m_per_s;
    const Eigen::Matrix3Xd after = cloth.after(1000, 1e-4).velocity_m_per_s;

    EXPECT_LT((momentum_kg_m_per_s(mass, after) - momentum_kg_m_per_s(mass, before)).norm(), 1e-14);
    EXPECT_GT((momentum_kg_m_per_s(cloth.cloth.mass_kg, after) -
               momentum_kg_m_per_s(cloth.cloth.mass_kg, before))
                  .norm(),
              1e-4);
  }
}

}  // namespace
}  // namespace clothfit
