// Checks surfaces of fields, and the mannequin: closed, of the sizes that are asked for.

#include "model/garment/mannequin.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "data/input_error.h"
#include "model/garment/surface_nets.h"

namespace clothfit {
namespace {

TEST(SurfaceNets, EncloseABallsVolumeToSecondOrder) {
  const auto volume_error = [](double cell_m) {
    const Obstacle ball(zero_surface([](const Eigen::Vector3d& x) { return x.norm() - 0.1; },
                                     Eigen::Vector3d::Constant(-0.13),
                                     Eigen::Vector3d::Constant(0.14), cell_m));
    EXPECT_EQ(ball.open_edges(), 0);
    return ball.volume_m3() / (4.0 / 3 * std::numbers::pi * 1e-3) - 1;
  };
  const double coarse = volume_error(0.02), fine = volume_error(0.01);
  EXPECT_LT(std::abs(coarse), 0.02);
  EXPECT_NEAR(coarse / fine, 4, 0.8);
}

TEST(SurfaceNets, TellInsideFromOutsideOfWhatIsHardlyWiderThanACell) {
  // Bent fingers: three cones that meet at an angle, between three and four cells wide.
  const std::array<Eigen::Vector3d, 4> joint{
      Eigen::Vector3d(-0.1, 0, 0.03), {0.0, 0.01, -0.02}, {0.07, -0.02, 0.02}, {0.12, 0.03, 0.05}};
  const auto field = [&](const Eigen::Vector3d& x) {
    double least = 1;
    for (size_t k = 0; k + 1 < joint.size(); ++k) {
      const Eigen::Vector3d along = joint[k + 1] - joint[k];
      const double share = std::clamp((x - joint[k]).dot(along) / along.squaredNorm(), 0.0, 1.0);
      least = std::min(least, (x - joint[k] - share * along).norm() - 0.025 + 0.003 * share);
    }
    return least;
  };
  const Obstacle surface(
      zero_surface(field, Eigen::Vector3d::Constant(-0.2), Eigen::Vector3d::Constant(0.2), 0.015));
  std::mt19937 random(2);
  const auto draw = [&] { return static_cast<double>(random()) / 0x1p31 - 1; };
  for (int n = 0; n < 20000; ++n) {
    const Eigen::Vector3d point = 0.2 * Eigen::Vector3d(draw(), draw(), draw());
    const auto found = surface.distance(point, 1);
    ASSERT_TRUE(found);
    if (std::abs(field(point)) < 0.004) continue;
    ASSERT_EQ(found->distance_m < 0, field(point) < 0) << point.transpose();
  }
}

TEST(Mannequin, IsOutsideOfWhatStandsBesideIt) {
  // The sign of the distance from every part of the body, seen from all around and near.
  const TriangleMesh body = make_mannequin();
  const Obstacle surface(body);
  std::mt19937 random(6);
  const auto draw = [&] { return static_cast<double>(random()) / 0x1p31 - 1; };
  for (int n = 0; n < 40000; ++n) {
    // In front of the toes, behind the back, above the head, beyond the hands.
    Eigen::Vector3d point(0.8 * draw(), 0.5 * draw(), 0.9 + 1.2 * draw());
    if (std::abs(point.y()) < 0.19 && std::abs(point.x()) < 0.65 && point.z() > -0.02 &&
        point.z() < 1.73)
      point.y() = point.y() < 0 ? -0.19 : 0.19;
    const auto found = surface.distance(point, 5);
    ASSERT_TRUE(found);
    ASSERT_GT(found->distance_m, 0) << point.transpose();
  }
}

/// Returns the girth of a body at a height: that of a tape around the part nearer than `reach_m`.
double girth_m(const TriangleMesh& body, double height_m, double reach_m) {
  std::vector<Eigen::Vector2d> cut;
  for (const auto& corners : body.triangle.colwise())
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d a = body.vertex_m.col(corners[k]),
                            b = body.vertex_m.col(corners[(k + 1) % 3]);
      if ((a.z() < height_m) == (b.z() < height_m)) continue;
      const Eigen::Vector3d at = a + (height_m - a.z()) / (b.z() - a.z()) * (b - a);
      if (std::abs(at.x()) < reach_m) cut.emplace_back(at.head<2>());
    }
  // The tape is as long as the mean width over all directions times pi (Cauchy's formula).
  constexpr int kDirections = 720;
  double sum_m = 0;
  for (int n = 0; n < kDirections; ++n) {
    const double angle = std::numbers::pi * n / kDirections;
    const Eigen::Vector2d direction(std::cos(angle), std::sin(angle));
    const auto [low, high] = std::ranges::minmax(
        cut, {}, [&](const Eigen::Vector2d& point) { return point.dot(direction); });
    sum_m += (high - low).dot(direction);
  }
  return sum_m / kDirections * std::numbers::pi;
}

TEST(Mannequin, HasTheSizesThatAreAskedFor) {
  MannequinSize large;
  large.bust_m = 1.10;
  large.waist_m = 0.95;
  large.hips_m = 1.15;
  for (const MannequinSize& size : {MannequinSize(), large}) {
    const TriangleMesh body = make_mannequin(size);
    const Obstacle surface(body);
    EXPECT_EQ(surface.open_edges(), 0);
    EXPECT_GT(surface.volume_m3(), 0.05);
    EXPECT_NEAR(body.vertex_m.row(2).maxCoeff(), size.height_m, 0.005);
    EXPECT_NEAR(body.vertex_m.row(2).minCoeff(), 0, 0.005);
    EXPECT_NEAR(girth_m(body, 1.085, 0.25), size.waist_m, 0.02 * size.waist_m);
    EXPECT_NEAR(girth_m(body, 0.875, 0.25), size.hips_m, 0.02 * size.hips_m);
    EXPECT_NEAR(girth_m(body, 1.205, 0.19), size.bust_m, 0.03 * size.bust_m);
  }
}

TEST(Mannequin, GrowsInProportion) {
  MannequinSize child;
  const double half = 0.5;
  child.height_m *= half, child.bust_m *= half, child.waist_m *= half, child.hips_m *= half;
  const double volume_m3 = Obstacle(make_mannequin()).volume_m3();
  EXPECT_NEAR(Obstacle(make_mannequin(child, 0.0075)).volume_m3() / volume_m3, 0.125, 1e-6);

  child.waist_m = 0.1;
  EXPECT_THROW(make_mannequin(child), InputError);
}

}  // namespace
}  // namespace clothfit
