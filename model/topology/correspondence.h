#pragma once

#include <Eigen/Core>

namespace clothfit {

/// The places of points of a flat cloth in the triangles of one of its meshes.
struct Correspondence {
  Eigen::Matrix3Xi corner;  ///< of each point's triangle: vertices of the mesh
  Eigen::Matrix3Xd weight;  ///< barycentric coordinates there; sum to 1, some < 0 outside

  /// Returns the points' positions from those of the mesh's vertices [lethanh2007, equation 12]:
  /// 3 x points from 3 x vertices.
  Eigen::Matrix3Xd transfer(const Eigen::Matrix3Xd& position_m) const;
};

/// Says which triangle a point belongs to that lies in none, as points on a curved border do.
enum class OutsidePoints {
  /// That of the nearest centre of gravity [lethanh2007, section 4]. A long triangle's centre is
  /// far even where its side is near, so that weights may fall far below zero.
  nearest_centre,
  nearest_triangle  ///< that of the nearest point of any
};

/// Returns the correspondences of points with triangles in the plane. `point_m`: 2 x points;
/// `vertex_m`: 2 x vertices; `triangle`: 3 x triangles, indices of vertices. Triangles are sorted
/// into boxes, so that the time grows with the number of points. A point on a side that two
/// triangles share belongs to the first.
Correspondence correspond(const Eigen::Matrix2Xd& point_m, const Eigen::Matrix2Xd& vertex_m,
                          const Eigen::Matrix3Xi& triangle,
                          OutsidePoints outside = OutsidePoints::nearest_triangle);

/// Returns the same by looking at all triangles for every point: the reference.
Correspondence correspond_by_all(const Eigen::Matrix2Xd& point_m, const Eigen::Matrix2Xd& vertex_m,
                                 const Eigen::Matrix3Xi& triangle,
                                 OutsidePoints outside = OutsidePoints::nearest_triangle);

}  // namespace clothfit
