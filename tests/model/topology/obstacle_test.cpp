// Checks the nearest part of an obstacle's surface. Not checked here: the force there
// (effects/contact_mesh_test.cpp).

#include "model/topology/obstacle.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/model/ball_mesh.h"
#include "tests/model/touched_cloth.h"

namespace clothfit {
namespace {

using NearestPoint = Obstacle::Nearest;

/// Returns the unit cube, its corners given once for each of its twelve triangles.
TriangleMesh cube() {
  TriangleMesh mesh{Eigen::Matrix3Xd(3, 36), Eigen::Matrix3Xi(3, 12)};
  Eigen::Index v = 0;
  for (int axis = 0; axis < 3; ++axis) {
    for (const int side : {0, 1}) {
      const Eigen::Vector3d n = Eigen::Vector3d::Unit(axis);
      const Eigen::Vector3d a = Eigen::Vector3d::Unit((axis + 1) % 3);
      const Eigen::Vector3d b = Eigen::Vector3d::Unit((axis + 2) % 3);
      const Eigen::Vector3d base = side * n;
      const Eigen::Vector3d right = side == 1 ? a : b, up = side == 1 ? b : a;
      for (const Eigen::Vector3d& corner :
           {base, Eigen::Vector3d(base + right), Eigen::Vector3d(base + right + up), base,
            Eigen::Vector3d(base + right + up), Eigen::Vector3d(base + up)}) {
        mesh.vertex_m.col(v) = corner;
        mesh.triangle(v % 3, v / 3) = static_cast<int>(v);
        ++v;
      }
    }
  }
  return mesh;
}

TEST(Obstacle, OfACubeIsItsNearestFaceForWhatIsInsideAndNothingOutside) {
  const Obstacle obstacle(cube(), 1);
  ASSERT_EQ(obstacle.triangles(), 12);
  Uniform uniform(1);
  int inside = 0;
  for (int n = 0; n < 500; ++n) {
    const Eigen::Vector3d point = uniform.vectors(1, 0.8).col(0) + Eigen::Vector3d::Constant(0.5);

    const auto nearest = obstacle.beneath(point);

    const double depth = std::min(point.minCoeff(), 1 - point.maxCoeff());
    ASSERT_EQ(nearest.has_value(), depth > 0) << point.transpose();
    if (!nearest) continue;
    ++inside;
    EXPECT_NEAR((nearest->place_m - point).norm(), depth, 1e-15);
    EXPECT_EQ(nearest->kind, NearestPoint::face);
    EXPECT_NEAR(nearest->direction.dot(nearest->place_m - point), depth, 1e-15);
  }
  EXPECT_GT(inside, 50);
}

TEST(Obstacle, IsFoundByTheTreeAsByTryingEveryTriangle) {
  // The cube is dented, so that edges and corners are nearest too; turned, so that no box is tight.
  Uniform uniform(2);
  TriangleMesh ball = ball_mesh(3);
  for (Eigen::Index v = 0; v < ball.vertex_m.cols(); ++v) ball.vertex_m.col(v) *= uniform(0.8, 1);
  const Obstacle obstacle(ball, 0.5);
  int kinds[3] = {0, 0, 0};
  for (int n = 0; n < 300; ++n) {
    const Eigen::Vector3d point = uniform.vectors(1, 0.4).col(0);  // inside

    const auto nearest = obstacle.beneath(point);

    double least = INFINITY;
    for (Eigen::Index t = 0; t < ball.triangle.cols(); ++t) {
      const Eigen::Vector3d a = ball.vertex_m.col(ball.triangle(0, t)),
                            b = ball.vertex_m.col(ball.triangle(1, t)),
                            c = ball.vertex_m.col(ball.triangle(2, t));
      const Obstacle alone(
          {(Eigen::Matrix3Xd(3, 3) << a, b, c).finished(), Eigen::Vector3i(0, 1, 2)}, 10);
      // A point below a face sees it; beyond its edges, those are borders of this lone triangle.
      if (const auto face = alone.beneath(point))
        least = std::min(least, (face->place_m - point).norm());
      for (const auto& [from, to] : {std::pair{a, b}, {b, c}, {c, a}}) {
        const double share =
            std::clamp((to - from).dot(point - from) / (to - from).squaredNorm(), 0.0, 1.0);
        least = std::min(least, (from + share * (to - from) - point).norm());
      }
    }
    if (least >= 0.5) {
      EXPECT_FALSE(nearest);
      continue;
    }
    ASSERT_TRUE(nearest) << point.transpose();
    EXPECT_NEAR((nearest->place_m - point).norm(), least, 1e-14);
    ++kinds[nearest->kind];
  }
  EXPECT_GT(kinds[NearestPoint::face], 10);
  EXPECT_GT(kinds[NearestPoint::edge], 10);
  EXPECT_GT(kinds[NearestPoint::corner], 10);
}

TEST(Obstacle, TellsTheDistanceFromACubeOnBothSides) {
  const Obstacle obstacle(cube());
  EXPECT_EQ(obstacle.open_edges(), 0);
  EXPECT_NEAR(obstacle.volume_m3(), 1, 1e-15);
  Uniform uniform(4);
  int inside = 0, outside = 0;
  for (int n = 0; n < 500; ++n) {
    const Eigen::Vector3d point = uniform.vectors(1, 1).col(0) + Eigen::Vector3d::Constant(0.5);
    const Eigen::Vector3d beyond = (-point).cwiseMax(point - Eigen::Vector3d::Ones());
    const double expected = beyond.maxCoeff() < 0 ? beyond.maxCoeff() : beyond.cwiseMax(0).norm();

    const auto found = obstacle.distance(point, 10);

    ASSERT_TRUE(found);
    EXPECT_NEAR(found->distance_m, expected, 1e-14) << point.transpose();
    EXPECT_NEAR((found->place_m + found->distance_m * found->outwards - point).norm(), 0, 1e-14);
    EXPECT_NEAR(found->outwards.norm(), 1, 1e-14);
    EXPECT_FALSE(obstacle.distance(point, std::abs(expected) - 1e-9));
    ++(expected < 0 ? inside : outside);
  }
  EXPECT_GT(inside, 30);
  EXPECT_GT(outside, 200);
}

TEST(Obstacle, IsNotClosedWhereAFaceIsTurnedRound) {
  TriangleMesh turned = cube();
  std::swap(turned.triangle(0, 3), turned.triangle(1, 3));
  EXPECT_EQ(Obstacle(turned).open_edges(), 3);
}

TEST(Obstacle, AnOpenSurfaceEndsAtItsBorder) {
  const Obstacle ground(hilly_ground(), 0.3);

  EXPECT_TRUE(ground.beneath({0.2, 0.2, -0.1}));
  EXPECT_FALSE(ground.beneath({0.2, 0.2, 0.1}));    // above
  EXPECT_FALSE(ground.beneath({0.2, 0.2, -0.4}));   // deeper than the reach
  EXPECT_FALSE(ground.beneath({1.0, 0.2, -0.05}));  // beyond the border
  EXPECT_GT(ground.open_edges(), 3);
}

TEST(Obstacle, WithoutAreaIsNothing) {
  const Obstacle line(
      {(Eigen::Matrix3Xd(3, 3) << 0, 1, 2, 0, 0, 0, 0, 0, 0).finished(), Eigen::Vector3i(0, 1, 2)});

  EXPECT_EQ(line.triangles(), 0);
  EXPECT_FALSE(line.beneath({1, 0, -0.01}));
}

}  // namespace
}  // namespace clothfit
