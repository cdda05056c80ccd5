// Checks the energy of sheets of fabric, its derivatives, and that sheets settle where it is least.

#include "model/sheet/sheet_energy.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "model/sheet/settle.h"
#include "tests/model/measured_cloth.h"

namespace clothfit {
namespace {

ClothMesh disc(double spacing_m) {
  return mesh_cloth({.border_m = {circle_m(0.05, spacing_m)}, .line_m = {}}, spacing_m);
}

Eigen::Matrix3Xd flat(const ClothMesh& mesh) {
  Eigen::Matrix3Xd position = Eigen::Matrix3Xd::Zero(3, mesh.vertex_count());
  position.topRows<2>() = mesh.material_m;
  return position;
}

Eigen::Matrix3Xd crumpled(const ClothMesh& mesh, double by_m, unsigned seed) {
  std::mt19937 random(seed);
  Eigen::Matrix3Xd position = flat(mesh);
  for (double& x : position.reshaped()) x += by_m * (static_cast<double>(random()) / 0x1p31 - 1);
  return position;
}

TEST(SheetEnergy, OfAStretchedSheetIsThatOfTheMeasuredStiffness) {
  const ClothMesh mesh = disc(0.01);
  SheetEnergy energy(mesh, kMeasuredCloth);
  energy.set_gravity(Eigen::Vector3d::Zero());
  const double strain = 1e-4;
  Eigen::Matrix3Xd gradient;
  const auto per_area = [&](double s, double t, double shear) {
    Eigen::Matrix2d f;
    f << 1 + s, shear, 0, 1 + t;
    Eigen::Matrix3Xd position = flat(mesh);
    position.topRows<2>() = f * mesh.material_m;
    return energy.energy_and_gradient(position, gradient) /
           (0.5 * strain * strain * mesh.total_area_m2());
  };

  // Finite strain changes these in their third digit of the strain.
  EXPECT_NEAR(per_area(strain, 0, 0), kMeasuredCloth.tension_weft_n_per_m, 0.1);
  EXPECT_NEAR(per_area(0, strain, 0), kMeasuredCloth.tension_warp_n_per_m, 0.1);
  EXPECT_NEAR(per_area(0, 0, strain), kMeasuredCloth.shear_n_per_m, 0.1);
  EXPECT_NEAR(per_area(strain, strain, 0), 500 + 400 + 2 * 40, 0.2) << "Cauchy: C12 = C33";
}

TEST(SheetEnergy, IsTheSameAfterTurningAndHasNoForceOrMomentOfItsOwn) {
  const ClothMesh mesh = disc(0.01);
  SheetEnergy energy(mesh, kMeasuredCloth);
  energy.set_gravity(Eigen::Vector3d::Zero());
  const Eigen::Matrix3Xd position = crumpled(mesh, 1e-3, 3);
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.8, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  Eigen::Matrix3Xd gradient, turned_gradient;

  const double before = energy.energy_and_gradient(position, gradient);
  const double after = energy.energy_and_gradient(turn * position, turned_gradient);

  EXPECT_NEAR(after / before, 1, 1e-12);
  EXPECT_LT((turned_gradient - turn * gradient).norm(), 1e-10 * gradient.norm());
  EXPECT_LT(gradient.rowwise().sum().norm(), 1e-12 * gradient.norm());
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  for (int v = 0; v < mesh.vertex_count(); ++v)
    moment += Eigen::Vector3d(position.col(v)).cross(Eigen::Vector3d(gradient.col(v)));
  EXPECT_LT(moment.norm(), 1e-12 * gradient.norm());
}

TEST(SheetEnergy, HasTheGradientAndSecondDerivativeOfDifferences) {
  const ClothMesh mesh = disc(0.02);
  std::vector<bool> clamped(static_cast<size_t>(mesh.vertex_count()), false);
  clamped[0] = clamped[1] = true;
  const SheetEnergy energy(mesh, kMeasuredCloth, clamped);
  const Eigen::Matrix3Xd position = crumpled(mesh, 2e-3, 4), way = crumpled(mesh, 1, 5);
  const double step = 1e-6;
  Eigen::Matrix3Xd gradient, before, after;
  energy.energy_and_gradient(position, gradient);
  const double ahead = energy.energy_and_gradient(position + step * way, after),
               behind = energy.energy_and_gradient(position - step * way, before);
  std::vector<Eigen::Matrix3d> blocks;

  energy.second_derivative(position, Curvature::exact, blocks);

  const double slope = gradient.cwiseProduct(way).sum();
  EXPECT_NEAR((ahead - behind) / (2 * step) / slope, 1, 1e-6);
  Eigen::Matrix3Xd product = Eigen::Matrix3Xd::Zero(3, mesh.vertex_count());
  for (size_t p = 0; p < blocks.size(); ++p) {
    const auto& [low, high] = energy.pairs()[p];
    product.col(high) += blocks[p] * way.col(low);
    if (low != high) product.col(low) += blocks[p].transpose() * way.col(high);
  }
  const Eigen::Matrix3Xd differences = (after - before) / (2 * step);
  EXPECT_LT((product - differences).norm(), 1e-6 * differences.norm());
}

TEST(SheetEnergy, TwistsASquareOfTheLatticeWithoutStretchingItsFibres) {
  const double side_m = 0.02;
  Eigen::Matrix2Xd corners(2, 4);
  corners << 0, side_m, side_m, 0, 0, 0, side_m, side_m;
  const ClothMesh mesh = mesh_cloth({.border_m = {corners}, .line_m = {}}, side_m);
  MeasuredFabric limp = kMeasuredCloth;
  limp.bending_warp_n_m = limp.bending_weft_n_m = 1e-8;
  SheetEnergy energy(mesh, limp);
  energy.set_gravity(Eigen::Vector3d::Zero());
  Eigen::Matrix3Xd twisted = flat(mesh), gradient;
  for (int v = 0; v < 4; ++v)
    twisted(2, v) =
        20 * (mesh.material_m(0, v) - 0.5 * side_m) * (mesh.material_m(1, v) - 0.5 * side_m);

  const double found = energy.energy_and_gradient(twisted, gradient);

  EXPECT_NEAR(found, 0.5 * side_m * side_m * 2e-8 * 20 * 20, 1e-15) << "of bending alone";
}

TEST(Settle, FindsTheHangingStripOfClosedForm) {
  // A vertical strip under its weight: tension falls linearly from the top, w l^2 / (2 C) longer.
  Eigen::Matrix2Xd corners(2, 4);
  corners << 0, 0.05, 0.05, 0, 0, 0, 0.4, 0.4;
  const ClothMesh mesh = mesh_cloth({.border_m = {sampled_m(corners, 0.01)}, .line_m = {}}, 0.01);
  MeasuredFabric fabric = kMeasuredCloth;
  fabric.shear_n_per_m = 0.1;  // hardly any lateral contraction
  SheetEnergy energy(mesh, fabric);
  energy.set_gravity({0, 9.81, 0});
  std::vector<bool> held;
  for (const auto& vertex : mesh.material_m.colwise()) held.push_back(vertex.y() == 0);
  Eigen::Matrix3Xd position = crumpled(mesh, 2e-3, 6);
  for (int v = 0; v < mesh.vertex_count(); ++v)
    if (held[static_cast<size_t>(v)]) position.col(v) << mesh.material_m.col(v), 0;
  SettleRule rule;
  rule.stop.gradient_n = 1e-8 * energy.weight_n();
  rule.stop.most_iterations = 300;
  rule.stop.lowest_energy_j = -std::numeric_limits<double>::infinity();
  rule.load_n = energy.weight_n();
  rule.first_shift_per_s2 = 9.81 / 0.4;

  const MinimiseResult result = settle(energy, held, rule, position);

  ASSERT_EQ(result.reason, MinimiseReason::converged);
  const double longer_m =
      0.5 * fabric.areal_density_kg_per_m2 * 9.81 * 0.4 * 0.4 / fabric.tension_warp_n_per_m;
  double found_m = 0;
  int ends = 0;
  for (int v = 0; v < mesh.vertex_count(); ++v)
    if (mesh.material_m(1, v) > 0.399) {
      found_m += position(1, v) - 0.4;
      ++ends;
    }
  EXPECT_NEAR(found_m / ends / longer_m, 1, 0.01);
}

TEST(Settle, SaysWhenNothingLowersTheEnergyFurtherOrItIsToldToStop) {
  const ClothMesh mesh = disc(0.02);
  SheetEnergy energy(mesh, kMeasuredCloth);
  std::vector<bool> held(static_cast<size_t>(mesh.vertex_count()), false);
  held[0] = true;
  Eigen::Matrix3Xd position = flat(mesh);
  SettleRule rule;
  rule.stop.gradient_n = 1e-6;
  rule.stop.most_iterations = 1000;
  rule.stop.lowest_energy_j = -std::numeric_limits<double>::infinity();
  rule.stop.go_on = [](int iteration, double) { return iteration < 2; };
  rule.load_n = energy.weight_n();
  rule.first_shift_per_s2 = 100;

  EXPECT_EQ(settle(energy, held, rule, position).reason, MinimiseReason::cancelled);

  position(0, 3) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(settle(energy, held, rule, position).reason, MinimiseReason::not_finite);
}

}  // namespace
}  // namespace clothfit
