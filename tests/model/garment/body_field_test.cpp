// Checks the smooth field of distances to a body against exact ones and differences.

#include "model/garment/body_field.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "model/garment/surface_nets.h"

namespace clothfit {
namespace {

constexpr double kRadius_m = 0.1;

TriangleMesh ball(double cell_m) {
  return zero_surface([](const Eigen::Vector3d& x) { return x.norm() - kRadius_m; },
                      Eigen::Vector3d::Constant(-0.13), Eigen::Vector3d::Constant(0.13), cell_m);
}

/// A block whose two upper halves meet in a ditch along the y axis, at a right angle.
TriangleMesh ditch() {
  TriangleMesh mesh;
  mesh.vertex_m.resize(3, 10);
  mesh.triangle.resize(3, 16);
  for (int end = 0; end < 2; ++end) {
    const double y = 0.2 * end - 0.1;
    mesh.vertex_m.middleCols<5>(5 * end) << -0.1, 0.1, 0.1, 0, -0.1, y, y, y, y, y, -0.1, -0.1, 0.1,
        0, 0.1;
  }
  mesh.triangle << 3, 3, 3, 8, 8, 8, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4,  //
      4, 0, 1, 5, 6, 7, 5, 6, 6, 7, 7, 8, 8, 9, 9, 5,               //
      0, 1, 2, 9, 5, 6, 6, 1, 7, 2, 8, 3, 9, 4, 5, 0;
  return mesh;
}

std::vector<Eigen::Vector3d> places_around(double radius_m, int count) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  std::vector<Eigen::Vector3d> places;
  for (int n = 0; n < count; ++n)
    places.push_back(radius_m *
                     Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized());
  return places;
}

TEST(BodyField, KeepsTheDistanceAndTheCurvatureOfABall) {
  const Obstacle body(ball(0.004));
  const BodyField field(body, 0.006);
  for (const double away_m : {-0.01, 0.0, 0.003}) {
    double curvature_per_m = 0;
    Eigen::Vector3d turned = Eigen::Vector3d::Zero();
    const std::vector<Eigen::Vector3d> places = places_around(kRadius_m + away_m, 400);
    for (const Eigen::Vector3d& place_m : places) {
      double way_m = 0;
      const auto found = field.near(place_m, 0.01, way_m);
      ASSERT_TRUE(found);
      EXPECT_NEAR(found->distance_m, away_m, 1e-4);  // flat triangles
      curvature_per_m += found->per_m.trace() / static_cast<double>(places.size());
      // Flat triangles turn the gradient by up to 0.04, to either side.
      EXPECT_LT((found->gradient - place_m.normalized()).norm(), 0.05);
      turned += (found->gradient - place_m.normalized()) / static_cast<double>(places.size());
    }
    EXPECT_NEAR(curvature_per_m, 2 / (kRadius_m + away_m), 0.04 * 2 / kRadius_m);
    EXPECT_LT(turned.norm(), 2e-3);
  }
}

TEST(BodyField, HasTheDerivativesOfDifferences) {
  const Obstacle body(ball(0.02));
  const BodyField field(body, 0.006);
  double way_m = 0;
  for (const Eigen::Vector3d& place_m : places_around(0.098, 30)) {
    const auto at = field.near(place_m, 0.01, way_m);
    constexpr double kStep_m = 1e-7;
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d aside = kStep_m * Eigen::Vector3d::Unit(axis);
      const auto up = field.near(place_m + aside, 0.01, way_m),
                 down = field.near(place_m - aside, 0.01, way_m);
      EXPECT_NEAR((up->distance_m - down->distance_m) / (2 * kStep_m), at->gradient[axis], 1e-6);
      EXPECT_LT(((up->gradient - down->gradient) / (2 * kStep_m) - at->per_m.col(axis)).norm(),
                1e-4 * at->per_m.norm() + 1e-3);
    }
  }
}

TEST(BodyField, RoundsADitch) {
  // Across a ditch the exact gradient jumps by the square root of 2.
  const Obstacle body(ditch());
  const BodyField field(body, 0.004);
  double way_m = 0, steepest_change = 0;
  ASSERT_EQ(body.open_edges(), 0);
  ASSERT_GT(body.volume_m3(), 0);
  Eigen::Vector3d last;
  for (int n = -200; n <= 200; ++n) {
    const auto found = field.near({1e-4 * n, 0.01, 0.005}, 0.01, way_m);
    ASSERT_TRUE(found);
    if (n > -200) steepest_change = std::max(steepest_change, (found->gradient - last).norm());
    last = found->gradient;
    EXPECT_NEAR(found->distance_m, body.distance({1e-4 * n, 0.01, 0.005}, 1)->distance_m, 1e-3);
  }
  EXPECT_LT(steepest_change, 0.06);  // over 0.1 mm, of cells of 4 mm
}

TEST(BodyField, SaysHowFarAPlaceMayGo) {
  const Obstacle body(ball(0.01));
  const BodyField field(body, 0.006);
  for (const double away_m : {0.02, 0.1, 5.0})
    for (const Eigen::Vector3d& place_m : places_around(kRadius_m + away_m, 20)) {
      double way_m = 0;
      EXPECT_FALSE(field.near(place_m, 0.003, way_m));
      EXPECT_GT(way_m, 0.9 * (away_m - 0.003 - 0.012) - 1e-3);
      double ignored_m = 0;
      EXPECT_FALSE(field.near(place_m - 0.999 * way_m * place_m.normalized(), 0.003, ignored_m));
    }
}

}  // namespace
}  // namespace clothfit
