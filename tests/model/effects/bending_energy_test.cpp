// Checks the bending stiffness of a plate. Not checked here: that a whole cloth moves alike on
// several meshes (mesh_refinement_test.cpp).

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "model/effects/registry.h"
#include "tests/model/effect_contract.h"

namespace clothfit {
namespace {

constexpr double kB_nm = 2e-5;

Eigen::Matrix3Xd forces_n(const Cloth& cloth, const Eigen::Matrix3Xd& position_m) {
  Uniform unused(0);
  effect_contract::State state(unused);
  state.cloth = cloth;
  state.position_m = position_m;
  state.velocity_m_per_s = at_rest(position_m);
  return effect_contract::force_n(find_effect("bending_energy", "test"), state, {kB_nm});
}

/// Returns the energy (J) from the forces, which are linear in the positions: f = -K x and E = x K
/// x / 2.
double energy_j(const Cloth& cloth, const Eigen::Matrix3Xd& position_m) {
  return -0.5 * forces_n(cloth, position_m).cwiseProduct(position_m).sum();
}

Cloth sheet(int columns, int rows) {
  const Mesh mesh{.columns = columns, .rows = rows, .width_m = 0.3, .height_m = 0.4};
  return Cloth::of(mesh, masses_by_area(mesh, 0.02));
}

TEST(BendingEnergy, KeepsTheContractOfEffects) {
  expect_effect_contract("bending_energy",
                         {.isotropic = true, .proportional = true, .internal = true});
}

TEST(BendingEnergy, IsNothingInAFlatClothHoweverItLies) {
  Uniform uniform(1);
  const Cloth cloth = sheet(6, 5);
  const Eigen::Matrix3d turn = uniform.rotation();

  const Eigen::Matrix3Xd f = forces_n(cloth, turn * flat_positions(cloth.mesh));

  // Second differences of 0.4 m are rounded at 1e-16 m, over spacings of 0.06 m.
  EXPECT_LT(f.cwiseAbs().maxCoeff(), 1e-15);
}

TEST(BendingEnergy, IsTheSameWhereverTheClothIsAndHoweverItIsTurned) {
  Uniform uniform(2);
  const Cloth cloth = sheet(6, 5);
  const Eigen::Matrix3Xd p = crumpled(cloth.mesh, 0.5, uniform);
  const double here = energy_j(cloth, p);

  const double there =
      energy_j(cloth, (uniform.rotation() * p).colwise() + Eigen::Vector3d(1, -2, 3));

  EXPECT_GT(here, 0);
  EXPECT_NEAR(there, here, 1e-11 * here);
}

TEST(BendingEnergy, OfACylinderIsHalfTheStiffnessOverTheRadiusSquaredPerArea) {
  const double radius_m = 0.15;
  for (const int rows : {9, 17, 33}) {
    for (const bool along_t : {true, false}) {
      SCOPED_TRACE(testing::Message() << rows << " rows, along " << (along_t ? "t" : "s"));
      const Mesh mesh = square_mesh(rows);
      const Cloth cloth = Cloth::of(mesh, masses_by_area(mesh, 0.02));
      const Eigen::Matrix3Xd flat = flat_positions(mesh);
      Eigen::Matrix3Xd rolled(3, flat.cols());
      for (Eigen::Index k = 0; k < flat.cols(); ++k) {
        const double angle = flat(along_t ? 1 : 0, k) / radius_m;
        rolled.col(k) << flat(along_t ? 0 : 1, k), radius_m * std::sin(angle),
            radius_m * std::cos(angle);
      }

      const double energy = energy_j(cloth, rolled);

      // Half a spacing along each free edge carries no moment. The polygon's second difference is 2
      // R (1 - cos(a / R)) / a^2 of the circle's 1 / R.
      const double a = mesh.spacing_t_m(), share = (rows - 2.0) / (rows - 1);
      const double chord = 2 * (1 - std::cos(a / radius_m)) * radius_m * radius_m / (a * a);
      const double circle = kB_nm / (2 * radius_m * radius_m) * 0.16;
      EXPECT_NEAR(energy, circle * share * chord * chord, 1e-12 * circle);
    }
  }
}

TEST(BendingEnergy, OfATwistedSheetIsTheStiffnessTimesItsTwistSquared) {
  // For z = w s t, x_st = w counts twice in E = B / 2 (... + 2 x_st^2), the same on every mesh.
  const double twist_per_m = 3;
  for (const int rows : {5, 11}) {
    const Cloth cloth = sheet(7, rows);
    Eigen::Matrix3Xd p = flat_positions(cloth.mesh);
    p.row(2) = twist_per_m * p.row(0).cwiseProduct(p.row(1));

    EXPECT_NEAR(energy_j(cloth, p), kB_nm * twist_per_m * twist_per_m * 0.12, 1e-16);
  }
}

/// Returns the sag (m) of the free end of a horizontal ribbon of 0.4 m under its weight per area.
/// Its first two rows are held. The sag follows from the effect's own derivatives: K w = load.
double sag_m(int rows, double load_n_per_m2) {
  const Mesh mesh{.columns = 3, .rows = rows, .width_m = 0.1, .height_m = 0.4};
  const Cloth cloth = Cloth::of(mesh, masses_by_area(mesh, 0.01));
  const auto effect = find_effect("bending_energy", "").make();
  const EffectMap map(*effect, cloth, 1, EffectDeed::add_force);
  const Eigen::Matrix3Xd flat = flat_positions(mesh);
  const Eigen::MatrixXd jacobian =
      map.stated_jacobian(map.input(flat, at_rest(flat), {}, {0, 0, 0}, {kB_nm}));
  const int held = 2 * mesh.columns, free = mesh.vertex_count() - held;
  Eigen::MatrixXd stiffness(free, free);
  for (int a = 0; a < free; ++a)
    for (int b = 0; b < free; ++b)
      stiffness(a, b) = -jacobian(3 * (held + a) + 2, 3 * (held + b) + 2);
  const Eigen::VectorXd load_n =
      masses_by_area(mesh, load_n_per_m2 * mesh.width_m * mesh.height_m).tail(free);
  return stiffness.llt().solve(load_n)[free - 2];  // the middle of the last row
}

TEST(BendingEnergy, AClampedRibbonSagsLikeABeam) {
  // Bernoulli's beam sags by q L^4 / (8 B b) with q b the load per length. Two held rows clamp the
  // ribbon in the middle between them: L = 0.4 m less half a spacing.
  const double load_n_per_m2 = 1e-4;
  const auto beam_m = [&](double length_m) {
    return load_n_per_m2 * std::pow(length_m, 4) / (8 * kB_nm);
  };
  double coarser = 0;
  for (const int rows : {9, 17, 33}) {
    SCOPED_TRACE(rows);
    const double a = 0.4 / (rows - 1);

    const double sag = sag_m(rows, load_n_per_m2);

    // The discrete beam has a closed form: moments are exact, and sum to q (L (L - a))^2 / (8 B b).
    EXPECT_NEAR(sag, load_n_per_m2 * std::pow(0.4 * (0.4 - a), 2) / (8 * kB_nm), 1e-9 * sag);
    const double error = std::abs(sag / beam_m(0.4 - a / 2) - 1);
    if (coarser > 0) {
      EXPECT_NEAR(coarser / error, 4, 0.5);  // second order
    }
    coarser = error;
  }
  EXPECT_LT(coarser, 1e-3);
}

TEST(BendingEnergy, TheStepThatItsRatesAllowIsStableAndTwiceItIsNot) {
  // This cloth is bending stiffness and little else.
  const Mesh mesh = square_mesh(17);
  Cloth cloth = Cloth::of(mesh, masses_by_area(mesh, 0.025));
  cloth.held = {held_at(mesh, 0, 0), held_at(mesh, 0.4, 0)};
  add_effect(cloth, "bending_energy", "test");
  Uniform uniform(3);
  const ParameterSet set{.springs = spring_parameters(
                             {.tension_warp_n_per_m = 0.1, .tension_weft_n_per_m = 0.1}, mesh),
                         .gravity_m_per_s2 = Eigen::Vector3d::Zero(),
                         .effects = {{1e-3}},
                         .start_position_m = crumpled(mesh, 0.3, uniform)};
  const double stable_s = stable_time_step_s(cloth, set);
  const auto stays = [&](double step_s) {
    return simulate(cloth, {&set, 1}, {.frame_time_s = {0, 0.1}, .time_step_s = step_s})
        .front()
        .usable();
  };

  EXPECT_TRUE(stays(0.95 * stable_s));
  EXPECT_FALSE(stays(2 * stable_s));
}

}  // namespace
}  // namespace clothfit
