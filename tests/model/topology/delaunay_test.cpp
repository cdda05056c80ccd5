// Checks triangulations of points in the plane. Not checked here: the meshes made of them
// (cloth_mesh_test.cpp).

#include "model/topology/delaunay.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

#include "data/input_error.h"

namespace clothfit {
namespace {

using Triangles = std::vector<std::array<int, 3>>;

Eigen::Matrix2Xd random_points(int count, unsigned seed) {
  std::mt19937 random(seed);
  Eigen::Matrix2Xd points(2, count);
  for (auto point : points.colwise())
    point << static_cast<double>(random()) / 0x1p32, static_cast<double>(random()) / 0x1p32;
  return points;
}

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

double area(const Eigen::Matrix2Xd& points, const std::array<int, 3>& t) {
  return 0.5 * cross(points.col(t[1]) - points.col(t[0]), points.col(t[2]) - points.col(t[0]));
}

double least_area(const Eigen::Matrix2Xd& points, const Triangles& triangles) {
  double least = std::numeric_limits<double>::infinity();
  for (const auto& t : triangles) least = std::min(least, area(points, t));
  return least;
}

double total_area(const Eigen::Matrix2Xd& points, const Triangles& triangles) {
  double sum = 0;
  for (const auto& t : triangles) sum += area(points, t);
  return sum;
}

/// Says whether `p` lies inside the circle through a triangle's corners, by more than rounding.
bool in_circle(const Eigen::Matrix2Xd& points, const std::array<int, 3>& t,
               const Eigen::Vector2d& p) {
  Eigen::Matrix3d m;
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector2d d = points.col(t[static_cast<size_t>(k)]) - p;
    m.row(k) << d.x(), d.y(), d.squaredNorm();
  }
  return m.determinant() > 1e-12;
}

bool has_edge(const Triangles& triangles, int a, int b) {
  return std::ranges::any_of(triangles, [&](const auto& t) {
    return std::ranges::count(t, a) == 1 && std::ranges::count(t, b) == 1;
  });
}

TEST(Delaunay, LeavesNoPointInsideACircleThroughATrianglesCorners) {
  const Eigen::Matrix2Xd points = random_points(200, 1);

  const Triangles triangles = delaunay_triangles(points);

  ASSERT_GT(least_area(points, triangles), 0) << "counterclockwise";
  for (const auto& t : triangles)
    for (int p = 0; p < points.cols(); ++p)
      EXPECT_FALSE(std::ranges::count(t, p) == 0 && in_circle(points, t, points.col(p)));
}

TEST(Delaunay, FillsTheSquareOfALatticeWhosePointsLieOnCommonCircles) {
  constexpr int kSide = 12;
  Eigen::Matrix2Xd points(2, kSide * kSide);
  for (int k = 0; k < points.cols(); ++k) points.col(k) << k % kSide, k / kSide;

  const Triangles triangles = delaunay_triangles(points);

  EXPECT_EQ(triangles.size(), 2 * (kSide - 1) * (kSide - 1));
  EXPECT_DOUBLE_EQ(least_area(points, triangles), 0.5);
  EXPECT_DOUBLE_EQ(total_area(points, triangles), (kSide - 1) * (kSide - 1));
}

TEST(Delaunay, KeepsLinesThroughManyTrianglesAndTheAreaWithThem) {
  Eigen::Matrix2Xd points = random_points(300, 2);
  points.col(0) << -0.1, -0.11;  // a long line from corner to corner, and two short ones
  points.col(1) << 1.1, 1.12;
  const double before = total_area(points, delaunay_triangles(points));
  ASSERT_FALSE(has_edge(delaunay_triangles(points), 0, 1));

  const Triangles triangles = delaunay_triangles(points, {{0, 1}});

  EXPECT_TRUE(has_edge(triangles, 0, 1));
  EXPECT_GT(least_area(points, triangles), 0);
  EXPECT_NEAR(total_area(points, triangles), before, 1e-12);
}

TEST(Delaunay, RefusesLinesThatCrossAndPointsInOnePlace) {
  Eigen::Matrix2Xd square(2, 4);
  square << 0, 1, 1, 0, 0, 0, 1, 1;
  EXPECT_THROW(delaunay_triangles(square, {{0, 2}, {1, 3}}), InputError);

  Eigen::Matrix2Xd twice(2, 4);
  twice << 0, 1, 1, 1, 0, 0, 1, 1;
  EXPECT_THROW(delaunay_triangles(twice), InputError);

  Eigen::Matrix2Xd line(2, 3);
  line << 0, 1, 2, 0, 1, 2;
  EXPECT_THROW(delaunay_triangles(line), InputError);
  EXPECT_THROW(delaunay_triangles(line.leftCols(2)), InputError);
  EXPECT_THROW(delaunay_triangles(square.replicate(1, 2).leftCols(5)), InputError);

  Eigen::Matrix2Xd through(2, 4);  // the line from 0 to 1 passes through 2
  through << 0, 2, 1, 1, 0, 0, 0, 1;
  EXPECT_THROW(delaunay_triangles(through, {{0, 1}}), InputError);
}

}  // namespace
}  // namespace clothfit
