// Checks a cloth whose rest shape is curved. Not checked here: the bending stiffness that balances
// it (bending_energy_test.cpp).

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "model/effects/registry.h"
#include "tests/model/effect_contract.h"

namespace clothfit {
namespace {

TEST(RestCurvature, KeepsTheContractOfEffects) {
  expect_effect_contract("rest_curvature", {.isotropic = true, .internal = true});
}

/// Writes the energy a second time, vertex by vertex.
double energy_j(const Mesh& mesh, const Eigen::Matrix3Xd& x, double m_s, double m_t) {
  double energy = 0;
  for (int i = 0; i < mesh.rows; ++i) {
    for (int j = 0; j < mesh.columns; ++j) {
      const auto at = [&](int down, int right) -> Eigen::Vector3d {
        return x.col(mesh.vertex(std::clamp(i + down, 0, mesh.rows - 1),
                                 std::clamp(j + right, 0, mesh.columns - 1)));
      };
      const bool end_s = j == 0 || j == mesh.columns - 1, end_t = i == 0 || i == mesh.rows - 1;
      const double area_m2 = mesh.spacing_s_m() * mesh.spacing_t_m() * (end_s || end_t ? 0.5 : 1);
      const Eigen::Vector3d n = (at(0, 1) - at(0, -1)).cross(at(1, 0) - at(-1, 0)).normalized();
      if (!end_s)
        energy -= m_s * area_m2 / std::pow(mesh.spacing_s_m(), 2) *
                  n.dot(at(0, 1) - 2 * at(0, 0) + at(0, -1));
      if (!end_t)
        energy -= m_t * area_m2 / std::pow(mesh.spacing_t_m(), 2) *
                  n.dot(at(1, 0) - 2 * at(0, 0) + at(-1, 0));
    }
  }
  return energy;
}

TEST(RestCurvature, ItsForceIsMinusTheEnergysGradient) {
  Uniform uniform(1);
  effect_contract::State state(uniform);
  state.position_m = crumpled(state.cloth.mesh, 0.3, uniform);
  const double m_s = 2e-4, m_t = -3e-4;

  const Eigen::Matrix3Xd f =
      effect_contract::force_n(find_effect("rest_curvature", "test"), state, {m_s, m_t});

  const double step_m = 1e-6;
  for (Eigen::Index n = 0; n < f.size(); ++n) {
    Eigen::Matrix3Xd up = state.position_m, down = up;
    up.reshaped()[n] += step_m;
    down.reshaped()[n] -= step_m;
    const double slope =
        (energy_j(state.cloth.mesh, up, m_s, m_t) - energy_j(state.cloth.mesh, down, m_s, m_t)) /
        (2 * step_m);
    // Energies of 1e-4 J are rounded at 1e-20, over 2e-6 m; third derivatives are as in the
    // contract.
    EXPECT_NEAR(f.reshaped()[n], -slope, 1e-7 * f.cwiseAbs().maxCoeff()) << n;
  }
}

TEST(RestCurvature, IsNoStifferThanItsRatesSay) {
  const Cloth cloth = square_cloth(9);
  const auto effect = find_effect("rest_curvature", "").make();
  const std::vector<double> moments_n{8e-3, -5e-3};
  const double bound = effect->rates(cloth, {}, moments_n).frequency2_per_s2;
  for (const unsigned seed : {1u, 2u, 3u}) {
    Uniform uniform(seed);
    for (const double share : {0.0, 0.1, 0.3}) {
      const auto crumple = crumpled(cloth.mesh, share, uniform);

      const double seen =
          effect_contract::spectrum({{effect.get(), moments_n}}, cloth, crumple).frequency2_per_s2;

      EXPECT_LE(seen, bound) << share;
      EXPECT_GE(seen, 0.02 * bound) << share;
    }
  }
}

TEST(RestCurvature, AFreeStripWithBendingStiffnessRollsToMomentOverStiffness) {
  const double b_nm = 1e-4, m_t_n = 8e-4;
  const Mesh mesh{.columns = 3, .rows = 17, .width_m = 0.03, .height_m = 0.24};
  Cloth cloth = Cloth::of(mesh, masses_by_area(mesh, 0.15 * mesh.width_m * mesh.height_m));
  add_effect(cloth, "bending_energy", "test");
  add_effect(cloth, "rest_curvature", "test");
  add_effect(cloth, "viscous_damping", "test");
  Fabric fabric = cotton();  // its flexion springs would bear a part of the moment
  fabric.flexion_warp_n_per_m = fabric.flexion_weft_n_per_m = 0;
  const ParameterSet set{.springs = spring_parameters(fabric, mesh),
                         .gravity_m_per_s2 = Eigen::Vector3d::Zero(),
                         .effects = {{b_nm}, {0, m_t_n}, {15}},
                         .start_position_m = flat_positions(mesh)};
  const double h = 0.5 * stable_time_step_s(cloth, set);

  const SimulateResult result =
      simulate(cloth, {&set, 1}, {.frame_time_s = {0, 2}, .time_step_s = h}).front();

  ASSERT_TRUE(result.usable());
  const Eigen::Matrix3Xd& x = result.position_m.back();
  const double a = mesh.spacing_t_m();
  for (int i = 1; i < mesh.rows - 1; ++i) {
    const Eigen::Vector3d second =
        x.col(mesh.vertex(i + 1, 1)) - 2 * x.col(mesh.vertex(i, 1)) + x.col(mesh.vertex(i - 1, 1));
    const Eigen::Vector3d n =
        (x.col(mesh.vertex(i, 2)) - x.col(mesh.vertex(i, 0)))
            .cross(x.col(mesh.vertex(i + 1, 1)) - x.col(mesh.vertex(i - 1, 1)))
            .normalized();
    // Springs of finite stiffness give way by some moment times curvature over stiffness: 1e-3.
    EXPECT_NEAR(second.dot(n) / (a * a), m_t_n / b_nm, 5e-3 * m_t_n / b_nm) << i;
  }
}

}  // namespace
}  // namespace clothfit
