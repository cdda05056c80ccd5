// Checks stiffness that varies over the cloth.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/model/spring_rig.h"

namespace clothfit {
namespace {

constexpr double kUniform_n_per_m = 40;

struct Pattern {
  double patch = 0, patch_s = 0.5, patch_t = 0.5, patch_radius = 0.3, edge = 0, edge_width = 0.15,
         gradient_s = 0, gradient_t = 0, rectangle = 0, rectangle_s = 0.5, rectangle_t = 0.5,
         rectangle_half_s = 0.25, rectangle_half_t = 0.25;
  std::vector<double> values() const {
    return {patch,       patch_s,          patch_t,         patch_radius, edge,
            edge_width,  gradient_s,       gradient_t,      rectangle,    rectangle_s,
            rectangle_t, rectangle_half_s, rectangle_half_t};
  }
};

/// Returns the elongation (m) of a ribbon of `rows` rows under the tension of 1 N in each column.
/// It sums over its springs, whose stiffness is read off the effect's tension at a common
/// elongation.
double stretch_m(const Pattern& pattern, int rows) {
  DrivenRibbon ribbon(rows, kUniform_n_per_m, "nonuniform_stiffness", pattern.values());
  const Eigen::VectorXd e = Eigen::VectorXd::Constant(rows - 1, 0.01);
  const Eigen::VectorXd extra_n = ribbon.tensions_n(e, 0 * e, 1e-3);
  const Eigen::VectorXd k =
      kUniform_n_per_m + (extra_n / (0.01 * ribbon.natural_length_m())).array();
  return k.cwiseInverse().sum() / (rows - 1);  // per spring of the whole cloth: mesh-free
}

TEST(NonuniformStiffness, KeepsTheContractOfEffects) {
  expect_effect_contract("nonuniform_stiffness", {.isotropic = true, .internal = true});
}

TEST(NonuniformStiffness, AStripWithAGradientStretchesByTheIntegralOfItsCompliance) {
  // The integral over t in (0, 1) of 1 / (k (1 + g (2 t - 1))) is log((1 + g) / (1 - g)) / (2 g k).
  const double g = 0.6;
  const double exact = std::log((1 + g) / (1 - g)) / (2 * g) / kUniform_n_per_m;

  double coarser = 0;
  for (const int rows : {9, 17, 33, 65}) {
    const double error = std::abs(stretch_m({.gradient_t = g}, rows) - exact);
    if (coarser > 0) {  // the midpoint rule's order
      EXPECT_NEAR(coarser / error, 4, 0.2) << rows;
    }
    coarser = error;
  }
  EXPECT_LT(coarser, 1e-4 * exact);
}

TEST(NonuniformStiffness, SpringsInSeriesAreSofterThanTheirMean) {
  EXPECT_DOUBLE_EQ(stretch_m({}, 9), 1 / kUniform_n_per_m);
  EXPECT_GT(stretch_m({.gradient_t = 0.6}, 33), 1.1 / kUniform_n_per_m);
}

TEST(NonuniformStiffness, APatchIsFullInItsCentreAndNothingOutside) {
  // The ribbon's first column passes through the patch's centre, at t = 0.5.
  DrivenRibbon ribbon(22, kUniform_n_per_m, "nonuniform_stiffness",
                      Pattern{.patch = 2, .patch_s = 0, .patch_radius = 0.25}.values());
  const Eigen::VectorXd e = Eigen::VectorXd::Constant(21, 0.01);

  const Eigen::VectorXd share =
      ribbon.tensions_n(e, 0 * e, 1e-3) / (kUniform_n_per_m * 0.01 * ribbon.natural_length_m());

  for (int i = 0; i < 21; ++i) {
    const double from = std::abs((i + 0.5) / 21 - 0.5) / 0.25;
    const double expected = from < 1 ? 2 * std::pow(1 - from * from, 3) : 0;
    EXPECT_NEAR(share[i], expected, 1e-12) << i;  // the tension is a sum of 21
  }
}

TEST(NonuniformStiffness, ARectangleIsFullInsideAndNothingOutside) {
  // The ribbon's first column passes through the rectangle, from t = 0.25 to 0.75.
  DrivenRibbon ribbon(33, kUniform_n_per_m, "nonuniform_stiffness",
                      Pattern{.rectangle = 2, .rectangle_s = 0}.values());
  const Eigen::VectorXd e = Eigen::VectorXd::Constant(32, 0.01);

  const Eigen::VectorXd share =
      ribbon.tensions_n(e, 0 * e, 1e-3) / (kUniform_n_per_m * 0.01 * ribbon.natural_length_m());

  for (int i = 0; i < 32; ++i) {
    const double inside = 0.25 - std::abs((i + 0.5) / 32 - 0.5);
    const double u = std::clamp(16 * inside + 0.5, 0.0, 1.0);
    EXPECT_NEAR(share[i], 2 * u * u * (3 - 2 * u), 1e-12) << i;
  }
}

TEST(NonuniformStiffness, AnEdgeIsFullAtTheBorderAndNothingInside) {
  Uniform uniform(1);
  effect_contract::State state(uniform);
  // Only one vertex is moved out of the flat cloth, one in the middle or one of the border.
  const auto force = [&](int i, int j) {
    state.position_m = flat_positions(state.cloth.mesh);
    state.position_m(2, state.cloth.mesh.vertex(i, j)) += 0.05;
    state.velocity_m_per_s.setZero();
    return effect_contract::force_n(find_effect("nonuniform_stiffness", "test"), state,
                                    Pattern{.edge = 1, .edge_width = 0.1}.values());
  };

  EXPECT_GT(force(0, 3).norm(), 0.01);
  // Every spring of the inner vertex has its middle 0.2 or more from the border. Those of the
  // border are at rest, to the rounding of their lengths.
  EXPECT_LT(force(2, 2).norm(), 1e-13);
}

TEST(NonuniformStiffness, SurvivesAChangeOfMesh) {
  // The compliance is that of the whole strip, on meshes four times apart.
  const Pattern pattern{.patch = 3, .patch_s = 0, .edge = 1, .gradient_t = -0.3};
  const double fine = stretch_m(pattern, 129);

  EXPECT_NEAR(stretch_m(pattern, 33), fine, 2e-3 * fine);
}

}  // namespace
}  // namespace clothfit
