// Checks a garment's energy: derivatives, conservation, contact with a body, bending of seams.

#include "model/garment/garment_energy.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "model/garment/surface_nets.h"
#include "tests/model/garment/derivatives.h"
#include "tests/model/garment/patterns.h"
#include "tests/model/measured_cloth.h"

namespace clothfit {
namespace {

using Seams = GarmentEnergy::Seams;

/// A ball of 0.1 m about the origin.
const Obstacle& ball() {
  static const Obstacle obstacle(
      zero_surface([](const Eigen::Vector3d& x) { return x.norm() - 0.1; },
                   Eigen::Vector3d::Constant(-0.15), Eigen::Vector3d::Constant(0.15), 0.01));
  return obstacle;
}

TEST(GarmentEnergy, HasTheDerivativesOfDifferences) {
  const GarmentMesh mesh = mesh_garment(tube(0.1, 0.1, 0.02), 0.02);
  GarmentEnergy open(mesh, {kMeasuredCloth}, Seams::open),
      sewn(mesh, {kMeasuredCloth}, Seams::sewn);
  open.set_thread(1e4);
  expect_derivatives(open, shaken(mesh.placed_m, 1e-3), 1e-5);
  expect_derivatives(sewn, shaken(sewn.particles_m(mesh.placed_m), 1e-3), 1e-5);
}

TEST(GarmentEnergy, OfABodyHasTheDerivativesOfDifferences) {
  const GarmentMesh mesh = mesh_garment(tube(0.05, 0.05, 0.1), 0.01);
  GarmentEnergy energy(mesh, {kMeasuredCloth}, Seams::open);
  for (const double distance_m : {0.002, 0.0005, -0.003}) {
    const BodyField field(ball(), 0.006);
    energy.set_body(field, 0.003);
    Eigen::Matrix3Xd position = shaken(mesh.placed_m, 1e-3);
    for (auto point : position.colwise()) point *= (0.1 + distance_m) / point.norm();
    expect_derivatives(energy, position, 1e-5);
  }
}

TEST(GarmentEnergy, HasNoForceOrMomentOfItsOwn) {
  const GarmentMesh mesh = mesh_garment(tube(0.1, 0.1, 0.02), 0.02);
  for (const Seams seams : {Seams::open, Seams::sewn}) {
    GarmentEnergy energy(mesh, {kMeasuredCloth}, seams);
    energy.set_gravity(Eigen::Vector3d::Zero());
    energy.set_thread(100);
    const Eigen::Matrix3Xd position =
        shaken(seams == Seams::open ? mesh.placed_m : energy.particles_m(mesh.placed_m), 2e-3);
    Eigen::Matrix3Xd gradient;
    energy.energy_and_gradient(position, gradient);
    Eigen::Vector3d moment = Eigen::Vector3d::Zero();
    for (Eigen::Index v = 0; v < gradient.cols(); ++v) {
      const Eigen::Vector3d at = position.col(v), force = gradient.col(v);
      moment += at.cross(force);
    }
    EXPECT_LT(gradient.rowwise().sum().norm(), 1e-12 * gradient.norm() * 100);
    EXPECT_LT(moment.norm(), 1e-12 * gradient.norm() * 100);
  }
}

TEST(GarmentEnergy, BendsASeamAsUncutCloth) {
  // A strip rolled to a cylinder, and the same strip sewn of two halves.
  const double radius_m = 0.05, width_m = 0.12, spacing_m = 0.005;
  const auto energy_j = [&](const Pattern& pattern) {
    const GarmentMesh mesh = mesh_garment(pattern, spacing_m);
    GarmentEnergy energy(mesh, {kMeasuredCloth}, Seams::sewn);
    energy.set_gravity(Eigen::Vector3d::Zero());
    Eigen::Matrix3Xd rolled(3, mesh.cloth.vertex_count());
    for (int v = 0; v < mesh.cloth.vertex_count(); ++v) {
      const double along = mesh.placed_m(0, v) / radius_m;
      rolled.col(v) << radius_m * std::sin(along), radius_m * std::cos(along), mesh.placed_m(2, v);
    }
    Eigen::Matrix3Xd gradient;
    return energy.energy_and_gradient(energy.particles_m(rolled), gradient);
  };
  const Panel whole = rectangle(width_m, 0.05, 0);
  Panel left = rectangle(0.5 * width_m, 0.05, 0), right = left;
  left.placement.pretranslate(Eigen::Vector3d(-0.25 * width_m, 0, 0));
  right.placement.pretranslate(Eigen::Vector3d(0.25 * width_m, 0, 0));
  Pattern halves = pattern_of({left, right});
  const double uncut = energy_j(pattern_of({whole})), cut = energy_j(halves);
  halves.seams = {seam(0, 1, 1, 3)};
  const double sewn = energy_j(halves);

  EXPECT_NEAR(uncut, 0.5 * kMeasuredCloth.bending_weft_n_m * width_m * 0.05 / radius_m / radius_m,
              0.06 * uncut);
  // Two cells beside the cut carry nothing; the seam gives it back, with its mean stiffness.
  EXPECT_LT(cut, 0.97 * uncut);
  const double lost = uncut - cut, given_back = sewn - cut;
  const double mean_over_weft =
      0.5 * (kMeasuredCloth.bending_warp_n_m / kMeasuredCloth.bending_weft_n_m + 1);
  EXPECT_NEAR(given_back / lost, mean_over_weft, 0.1 * mean_over_weft);
}

}  // namespace
}  // namespace clothfit
