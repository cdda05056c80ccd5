// Checks the meaning of a fabric's numbers: springs by type, and the continuum that the lattice
// approximates. Not checked here: the forces of these springs (cloth_sweep_test.cpp) and the motion
// under them (step_test.cpp).

#include "model/fabric/fabric.h"

#include <gtest/gtest.h>

#include "model/fabric/fabric_conversion.h"
#include "tests/model/mechanics.h"
#include "tests/model/random_cloth.h"

namespace clothfit {
namespace {

/// Returns the elastic energy per area (J/m^2) inside a cloth of square cells that is deformed by x
/// = F s. At one spacing the energy of a whole cloth is p mn + q m + r n + u in its numbers of
/// cells m, n (cells, edges, corners). The mixed difference keeps only p, the energy of one inner
/// cell.
double inner_energy_density(const Fabric& fabric, double spacing_m, const Eigen::Matrix2d& f) {
  const auto energy_j = [&](int cells_s, int cells_t) {
    const Mesh mesh{.columns = cells_s + 1,
                    .rows = cells_t + 1,
                    .width_m = cells_s * spacing_m,
                    .height_m = cells_t * spacing_m};
    Eigen::Matrix3Xd deformed = flat_positions(mesh);
    deformed.topRows<2>() = f * deformed.topRows<2>();
    return elastic_energy_j(make_springs(mesh), spring_parameters(fabric, mesh), deformed);
  };
  const double cell_j = energy_j(5, 6) - energy_j(4, 6) - energy_j(5, 5) + energy_j(4, 5);
  return cell_j / (spacing_m * spacing_m);
}

/// Returns the second derivative of the energy density by the size of the deformation 1 + size *
/// direction.
double stiffness_n_per_m(const Fabric& fabric, double spacing_m, const Eigen::Matrix2d& direction) {
  const double size = 1e-4;
  const Eigen::Matrix2d one = Eigen::Matrix2d::Identity();
  return (inner_energy_density(fabric, spacing_m, one + size * direction) +
          inner_energy_density(fabric, spacing_m, one - size * direction)) /
         (size * size);
}

constexpr Fabric kFabric{.tension_warp_n_per_m = 70,
                         .tension_weft_n_per_m = 40,
                         .shear_n_per_m = 9,
                         .flexion_warp_n_per_m = 3,
                         .flexion_weft_n_per_m = 2,
                         .damping_warp_s = 0.004,
                         .damping_weft_s = 0.002};

TEST(Fabric, WarpRunsAlongTAndWeftAlongS) {
  const Mesh mesh = square_mesh(5);

  const SpringParameters springs = spring_parameters(kFabric, mesh);

  EXPECT_EQ(springs.stiffness_n_per_m, (std::array<double, 6>{70, 40, 9, 9, 3, 2}));
  EXPECT_EQ(springs.natural_length_m, flat_lengths(mesh));
}

TEST(Fabric, DashpotsAreStiffnessTimesRetardationTime) {
  const SpringParameters springs = spring_parameters(kFabric, square_mesh(5));

  const std::array<double, 6> time_s = {0.004, 0.002, 0.003, 0.003, 0.004, 0.002};
  for (size_t type = 0; type < kSpringTypes; ++type)
    EXPECT_DOUBLE_EQ(springs.damping_ns_per_m[type],
                     springs.stiffness_n_per_m[type] * time_s[type]);
}

TEST(Fabric, IsAtRestWhenFlat) {
  const Mesh mesh{.columns = 6, .rows = 9, .width_m = 0.31, .height_m = 0.47};

  const double energy_j =
      elastic_energy_j(make_springs(mesh), spring_parameters(kFabric, mesh), flat_positions(mesh));

  EXPECT_LT(energy_j, 1e-28);  // (1e-16 m)^2 times stiffness and number of springs
}

TEST(Fabric, AmountsToTheContinuumThatItsHeaderStates) {
  const Eigen::Matrix2d along_s{{1, 0}, {0, 0}};
  const Eigen::Matrix2d along_t{{0, 0}, {0, 1}};
  const Eigen::Matrix2d shear{{0, 1}, {0, 0}};

  for (const double spacing_m : {0.05, 0.025, 0.003}) {
    SCOPED_TRACE(spacing_m);
    const double c11 = stiffness_n_per_m(kFabric, spacing_m, along_s);
    const double c22 = stiffness_n_per_m(kFabric, spacing_m, along_t);
    const double c33 = stiffness_n_per_m(kFabric, spacing_m, shear);
    const double both = stiffness_n_per_m(kFabric, spacing_m, along_s + along_t);
    const double c12 = (both - c11 - c22) / 2;

    // The strain is 1e-4: the next order is 1e-8 of it, and rounding 1e-7.
    EXPECT_NEAR(c11, 40 + 9 + 4 * 2, 1e-4);
    EXPECT_NEAR(c22, 70 + 9 + 4 * 3, 1e-4);
    EXPECT_NEAR(c12, 9, 1e-4);
    EXPECT_NEAR(c33, 9, 1e-4);
    const Continuum stated = continuum(kFabric);
    EXPECT_NEAR(stated.c11_n_per_m, c11, 1e-4);
    EXPECT_NEAR(stated.c22_n_per_m, c22, 1e-4);
    EXPECT_NEAR(stated.c12_n_per_m, c12, 1e-4);
    EXPECT_NEAR(stated.c33_n_per_m, c33, 1e-4);
  }
}

TEST(Fabric, TurningItInItsPlaneStoresNothing) {
  const Eigen::Matrix2d turn = Eigen::Rotation2Dd(0.7).toRotationMatrix();

  EXPECT_NEAR(inner_energy_density(kFabric, 0.025, turn), 0, 1e-20);
}

}  // namespace
}  // namespace clothfit
