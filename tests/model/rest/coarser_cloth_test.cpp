// Checks the same cloth on a coarser mesh, and shapes from one mesh to another. Not checked here:
// their use by the cascade (equilibrium_test.cpp).

#include "model/rest/coarser_cloth.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/model/random_cloth.h"

namespace clothfit {
namespace {

constexpr Mesh kFine{.columns = 44, .rows = 31, .width_m = 0.6, .height_m = 0.4};
constexpr Mesh kCoarse{.columns = 22, .rows = 16, .width_m = 0.6, .height_m = 0.4};

HangingCloth cotton_on(const Mesh& mesh) {
  return {.mesh = mesh,
          .natural_length_m = flat_lengths(mesh),
          .stiffness_n_per_m = spring_parameters(cotton(), mesh).stiffness_n_per_m,
          .mass_kg = masses_by_area(mesh, 0.04)};
}

TEST(CoarserMesh, HalvesTheCellsDownToTheLeast) {
  const Mesh coarse = coarser_mesh(kFine, 4);
  EXPECT_EQ(coarse.columns, 23);
  EXPECT_EQ(coarse.rows, 16);
  EXPECT_EQ(coarser_mesh({.columns = 2, .rows = 9, .width_m = 1, .height_m = 1}, 4).columns, 2);
}

TEST(CoarserCloth, KeepsTheMassAndItsCentre) {
  SCOPED_TRACE("seed 1");
  Uniform uniform(1);
  HangingCloth fine = cotton_on(kFine);
  for (double& m : fine.mass_kg) m *= uniform(0.5, 2);

  const HangingCloth coarse = on_mesh(fine, kCoarse);

  EXPECT_NEAR(coarse.mass_kg.sum(), fine.mass_kg.sum(), 1e-15);
  EXPECT_LT(
      (flat_positions(kCoarse) * coarse.mass_kg - flat_positions(kFine) * fine.mass_kg).norm(),
      1e-15);
}

TEST(CoarserCloth, StoresTheSameEnergyWhenItIsStretchedEvenly) {
  // Strains are 5 % along s, 3 % along t and some shear; energies are per area, away from the
  // edges.
  Eigen::Matrix3d strain = Eigen::Matrix3d::Identity();
  strain(0, 0) = 1.05;
  strain(1, 1) = 1.03;
  strain(0, 1) = 0.02;
  const HangingCloth fine = cotton_on(kFine);
  const HangingCloth coarse = on_mesh(fine, kCoarse);

  for (size_t t = 0; t < kSpringTypes; ++t) {
    const auto energy_per_area = [&](const HangingCloth& cloth) {
      const Spring spring = make_springs(cloth.mesh)[t].front();
      const Eigen::Matrix3Xd p = strain * flat_positions(cloth.mesh);
      const double extension =
          (p.col(spring.b) - p.col(spring.a)).norm() - cloth.natural_length_m[t];
      return 0.5 * cloth.stiffness_n_per_m[t] * extension * extension /
             (cloth.mesh.spacing_s_m() * cloth.mesh.spacing_t_m());
    };
    // Shear springs of cells of another shape run in another direction: the meshes' differ by 1 %.
    const double tolerance = t == shear_down || t == shear_up ? 0.03 : 1e-10;
    EXPECT_NEAR(energy_per_area(coarse), energy_per_area(fine), tolerance * energy_per_area(fine))
        << t;
  }
}

TEST(CoarserCloth, HoldsTheSamePoints) {
  const std::vector<HeldVertexWeights> fine = {held_at(kFine, 0, 0), held_at(kFine, 0.31, 0.17)};

  const std::vector<HeldVertexWeights> coarse = on_mesh(fine, kFine, kCoarse);

  const Eigen::Matrix3Xd flat = flat_positions(kCoarse);
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
  for (const auto& [vertex, weight] : coarse[1].weights) place += weight * flat.col(vertex);
  EXPECT_LT((place - Eigen::Vector3d(0.31, 0.17, 0)).norm(), 1e-12);
  EXPECT_EQ(coarse[0].weights.size(), 1u);
}

TEST(TransferShape, KeepsWhatIsLinearAndTheVerticesThatBothMeshesHave) {
  SCOPED_TRACE("seed 2");
  Uniform uniform(2);
  const Eigen::Matrix3d map = uniform.vectors(3, 1);
  EXPECT_LT(
      (transfer_shape(kCoarse, map * flat_positions(kCoarse), kFine) - map * flat_positions(kFine))
          .norm(),
      1e-13);

  const Mesh half{.columns = 5, .rows = 4, .width_m = 1, .height_m = 1};
  const Mesh full{.columns = 9, .rows = 7, .width_m = 1, .height_m = 1};
  const Eigen::Matrix3Xd shape = crumpled(half, 0.4, uniform);
  const Eigen::Matrix3Xd finer = transfer_shape(half, shape, full);
  for (int i = 0; i < half.rows; ++i)
    for (int j = 0; j < half.columns; ++j)
      EXPECT_EQ(finer.col(full.vertex(2 * i, 2 * j)), shape.col(half.vertex(i, j)));
  EXPECT_EQ(transfer_shape(half, shape, half), shape);
}

TEST(TransferShape, GoesThroughTheTriangleThatAVertexLiesIn) {
  // The mesh is one cell with a corner raised; the middle lies on the diagonal from [0, 0] to [1,
  // 1].
  const Mesh cell{.columns = 2, .rows = 2, .width_m = 1, .height_m = 1};
  const Mesh finer{.columns = 3, .rows = 3, .width_m = 1, .height_m = 1};
  Eigen::Matrix3Xd shape = flat_positions(cell);
  shape(2, cell.vertex(0, 1)) = 1;

  const Eigen::Matrix3Xd result = transfer_shape(cell, shape, finer);

  EXPECT_EQ(result(2, finer.vertex(1, 1)), 0);
  EXPECT_EQ(result(2, finer.vertex(0, 1)), 0.5);
  EXPECT_EQ(result(2, finer.vertex(1, 2)), 0.5);
  EXPECT_EQ(result(2, finer.vertex(1, 0)), 0);
}

}  // namespace
}  // namespace clothfit
