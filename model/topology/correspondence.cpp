#include "model/topology/correspondence.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <vector>

namespace clothfit {
namespace {

/// Triangles in the plane, one by one.
class FlatTriangles {
 public:
  FlatTriangles(const Eigen::Matrix2Xd& vertex_m, const Eigen::Matrix3Xi& triangle)
      : vertex_m_(vertex_m), triangle_(triangle) {}

  int count() const { return static_cast<int>(triangle_.cols()); }
  Eigen::Vector3i corners(int n) const { return triangle_.col(n); }
  Eigen::Vector2d corner_m(int n, int k) const { return vertex_m_.col(triangle_(k, n)); }

  Eigen::Vector3d weights(int n, const Eigen::Vector2d& point_m) const {
    const Eigen::Vector2d a = corner_m(n, 0), b = corner_m(n, 1) - a, c = corner_m(n, 2) - a,
                          p = point_m - a;
    const double twice = b.x() * c.y() - b.y() * c.x();
    const double by_b = (p.x() * c.y() - p.y() * c.x()) / twice,
                 by_c = (b.x() * p.y() - b.y() * p.x()) / twice;
    return {1 - by_b - by_c, by_b, by_c};
  }

  /// Returns the paper's `distance`, or that to the triangle itself; 0 inside.
  double distance_m(int n, const Eigen::Vector2d& point_m, OutsidePoints outside) const {
    // A point on a side is inside whatever the rounding.
    constexpr double kOnSide = 1e-12;
    if (weights(n, point_m).minCoeff() >= -kOnSide) return 0;
    if (outside == OutsidePoints::nearest_centre)
      return ((corner_m(n, 0) + corner_m(n, 1) + corner_m(n, 2)) / 3 - point_m).norm();
    double least = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector2d a = corner_m(n, k), along = corner_m(n, (k + 1) % 3) - a;
      const double share = std::clamp((point_m - a).dot(along) / along.squaredNorm(), 0.0, 1.0);
      least = std::min(least, (a + share * along - point_m).norm());
    }
    return least;
  }

 private:
  const Eigen::Matrix2Xd& vertex_m_;
  const Eigen::Matrix3Xi& triangle_;
};

/// The nearest triangle so far; of two as near, the one of lower index.
struct Found {
  int triangle = -1;
  double distance_m = std::numeric_limits<double>::infinity();

  void offer(int n, double distance) {
    if (distance < distance_m || (distance == distance_m && n < triangle)) *this = {n, distance};
  }
};

/// Square boxes over the plane. Each lists the triangles whose bounding box meets it.
class Boxes {
 public:
  Boxes(const FlatTriangles& triangles, const Eigen::Matrix2Xd& vertex_m) : triangles_(triangles) {
    low_m_ = vertex_m.rowwise().minCoeff();
    const Eigen::Vector2d extent = vertex_m.rowwise().maxCoeff() - low_m_;
    // About one triangle per box.
    side_m_ = std::max(std::sqrt(extent.x() * extent.y() / std::max(1, triangles.count())),
                       extent.maxCoeff() / 4096);
    for (int axis = 0; axis < 2; ++axis)
      count_[static_cast<size_t>(axis)] = static_cast<int>(extent[axis] / side_m_) + 1;
    listed_.resize(static_cast<size_t>(count_[0]) * static_cast<size_t>(count_[1]));
    for (int n = 0; n < triangles.count(); ++n) {
      Eigen::Vector2d least = triangles.corner_m(n, 0), most = least;
      for (int k = 1; k < 3; ++k) {
        least = least.cwiseMin(triangles.corner_m(n, k));
        most = most.cwiseMax(triangles.corner_m(n, k));
      }
      const auto [i0, j0] = box_of(least);
      const auto [i1, j1] = box_of(most);
      for (int i = i0; i <= i1; ++i)
        for (int j = j0; j <= j1; ++j) listed_[index(i, j)].push_back(n);
    }
  }

  Found nearest(const Eigen::Vector2d& point_m, OutsidePoints outside) const {
    const auto [i, j] = box_of(point_m);
    Found found;
    for (const int n : listed_[index(i, j)])
      found.offer(n, triangles_.distance_m(n, point_m, outside));
    if (found.distance_m == 0) return found;
    // Triangles that no box of a smaller ring lists are at least so far away, their centres too.
    const double outside_m = distance_to_boxes_m(point_m);
    for (int ring = 1; ring < std::max(count_[0], count_[1]); ++ring) {
      if (std::hypot((ring - 1) * side_m_, outside_m) > found.distance_m) break;
      for_ring(i, j, ring,
               [&](int n) { found.offer(n, triangles_.distance_m(n, point_m, outside)); });
    }
    return found;
  }

 private:
  std::array<int, 2> box_of(const Eigen::Vector2d& point_m) const {
    std::array<int, 2> box{};
    for (size_t axis = 0; axis < 2; ++axis) {
      const auto a = static_cast<Eigen::Index>(axis);
      const double steps = std::floor((point_m[a] - low_m_[a]) / side_m_);
      box[axis] = static_cast<int>(std::clamp(steps, 0.0, count_[axis] - 1.0));
    }
    return box;
  }
  /// Returns how far a point lies outside the area of all boxes.
  double distance_to_boxes_m(const Eigen::Vector2d& point_m) const {
    const Eigen::Vector2d high = low_m_ + side_m_ * Eigen::Vector2d(count_[0], count_[1]);
    return (point_m.cwiseMax(low_m_).cwiseMin(high) - point_m).norm();
  }
  size_t index(int i, int j) const {
    return static_cast<size_t>(i) * static_cast<size_t>(count_[1]) + static_cast<size_t>(j);
  }
  template <class Visit>
  void for_ring(int i, int j, int ring, const Visit& visit) const {
    for (int a = std::max(0, i - ring); a <= std::min(count_[0] - 1, i + ring); ++a)
      for (int b = std::max(0, j - ring); b <= std::min(count_[1] - 1, j + ring); ++b)
        if (std::max(std::abs(a - i), std::abs(b - j)) == ring)
          for (const int n : listed_[index(a, b)]) visit(n);
  }

  const FlatTriangles& triangles_;
  Eigen::Vector2d low_m_;
  double side_m_ = 0;
  std::array<int, 2> count_{};
  std::vector<std::vector<int>> listed_;
};

template <class Nearest>
Correspondence correspond_each(const Eigen::Matrix2Xd& point_m, const FlatTriangles& triangles,
                               const Nearest& nearest) {
  assert(triangles.count() > 0);
  Correspondence result{.corner = Eigen::Matrix3Xi(3, point_m.cols()),
                        .weight = Eigen::Matrix3Xd(3, point_m.cols())};
  for (Eigen::Index p = 0; p < point_m.cols(); ++p) {
    const Found found = nearest(point_m.col(p));
    result.corner.col(p) = triangles.corners(found.triangle);
    result.weight.col(p) = triangles.weights(found.triangle, point_m.col(p));
  }
  return result;
}

}  // namespace

Eigen::Matrix3Xd Correspondence::transfer(const Eigen::Matrix3Xd& position_m) const {
  Eigen::Matrix3Xd result(3, corner.cols());
  for (Eigen::Index p = 0; p < corner.cols(); ++p)
    result.col(p) = weight(0, p) * position_m.col(corner(0, p)) +
                    weight(1, p) * position_m.col(corner(1, p)) +
                    weight(2, p) * position_m.col(corner(2, p));
  return result;
}

Correspondence correspond(const Eigen::Matrix2Xd& point_m, const Eigen::Matrix2Xd& vertex_m,
                          const Eigen::Matrix3Xi& triangle, OutsidePoints outside) {
  const FlatTriangles triangles(vertex_m, triangle);
  const Boxes boxes(triangles, vertex_m);
  return correspond_each(point_m, triangles,
                         [&](const Eigen::Vector2d& p) { return boxes.nearest(p, outside); });
}

Correspondence correspond_by_all(const Eigen::Matrix2Xd& point_m, const Eigen::Matrix2Xd& vertex_m,
                                 const Eigen::Matrix3Xi& triangle, OutsidePoints outside) {
  const FlatTriangles triangles(vertex_m, triangle);
  return correspond_each(point_m, triangles, [&](const Eigen::Vector2d& p) {
    Found found;
    for (int n = 0; n < triangles.count(); ++n) found.offer(n, triangles.distance_m(n, p, outside));
    return found;
  });
}

}  // namespace clothfit
