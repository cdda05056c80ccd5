#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "model/topology/closest_points.h"
#include "model/topology/triangle_tree.h"

namespace clothfit {

/// The points, edges and triangles of a surface that may meet itself.
class SurfaceParts {
 public:
  /// `triangle`: 3 x triangles, indices of points; those without three points are left out.
  /// `centre_m`: 3 x triangles, places near each other where the triangles stay so, such as in the
  /// flat cloth. Points with the same number in `joined` (one entry per point) are drawn into one
  /// place: parts that have such points in common never meet.
  SurfaceParts(const Eigen::Matrix3Xi& triangle, const Eigen::Matrix3Xd& centre_m,
               std::vector<int> joined);

  /// Returns the pairs of parts that may come nearer than `reach_m` on the straight way from
  /// `from_m` by `move_m` (3 x points): all that do, and others whose boxes meet.
  std::vector<PartPair> near(const Eigen::Matrix3Xd& from_m, const Eigen::Matrix3Xd& move_m,
                             double reach_m);

  /// Returns how many edges pass through the inside of a triangle. The test is exact: it decides by
  /// the places as they are stored, without rounding.
  int crossings(const Eigen::Matrix3Xd& position_m);

  const std::vector<std::array<int, 3>>& triangles() const { return triangle_; }
  const std::vector<std::array<int, 2>>& edges() const { return edge_; }

 private:
  using Box = TriangleTree::Box;
  /// Points and edges that a triangle stands for, so that each is looked at once.
  struct Owned {
    std::vector<int> points, edges;
  };
  template <class A, class B>
  bool joined(const A& a, const B& b) const;

  std::vector<std::array<int, 3>> triangle_;
  std::vector<std::array<int, 2>> edge_;
  std::vector<Owned> owned_;  ///< of each triangle
  std::vector<int> joined_;
  TriangleTree tree_;
};

}  // namespace clothfit
