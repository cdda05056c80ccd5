#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace clothfit {

/// The lines of a flat piece of cloth that its mesh must have. Every point becomes a vertex, and
/// every stretch between neighbouring points an edge: lines are sampled as finely as the mesh.
struct ClothOutline {
  /// Closed lines around the cloth and its holes, in either direction, without their first point
  /// again at the end; 2 x points (s, t), metres.
  std::vector<Eigen::Matrix2Xd> border_m;
  /// Open lines inside, such as the rim of a support.
  std::vector<Eigen::Matrix2Xd> line_m;
};

/// Returns a closed line's points so that none is farther than `spacing_m` from the next. The given
/// corners stay; each stretch between two is cut evenly.
Eigen::Matrix2Xd sampled_m(const Eigen::Matrix2Xd& corner_m, double spacing_m);

/// Returns a regular polygon of edges not longer than `spacing_m`, whose corners lie on the circle
/// about the origin.
Eigen::Matrix2Xd circle_m(double radius_m, double spacing_m);

/// Returns the points of a closed line as an open one that ends where it begins.
Eigen::Matrix2Xd opened_m(const Eigen::Matrix2Xd& closed_m);

/// A piece of cloth between three or four vertices. Its deformation is that in its middle:
///
///   dx/d(s, t) = sum_k x_k gradient.col(k)',  3 x 2
struct ClothCell {
  int corners = 0;              ///< 3 or 4
  std::array<int, 4> vertex{};  ///< counterclockwise in the plane (s, t)
  Eigen::Matrix<double, 2, 4> gradient_per_m = Eigen::Matrix<double, 2, 4>::Zero();
  double area_m2 = 0;  ///< > 0
};

/// The mesh of a flat piece of cloth of any outline. Squares of a lattice along the grain (warp
/// along t, weft along s) fill the inside; triangles lie between them and the outline.
struct ClothMesh {
  Eigen::Matrix2Xd material_m;  ///< (s, t) of every vertex, in the flat cloth
  std::vector<ClothCell> cells;
  double spacing_m = 0;     ///< of the lattice
  Eigen::VectorXd area_m2;  ///< of the flat cloth that belongs to every vertex
  /// Vertices of each closed line of the outline, in its order: counterclockwise around the cloth,
  /// clockwise around a hole.
  std::vector<std::vector<int>> border;
  std::vector<std::vector<int>> line;  ///< the same of the open lines

  int vertex_count() const { return static_cast<int>(material_m.cols()); }
  double total_area_m2() const { return area_m2.sum(); }
  /// Returns the cells as triangles, squares cut in two, 3 x triangles.
  Eigen::Matrix3Xi triangles() const;
};

/// Meshes a piece of cloth with a lattice of `spacing_m`. The lattice begins at the lower left
/// corner of the outline's bounding box, so that a rectangle of whole squares has nothing else. Its
/// vertices keep half a spacing's distance from all lines.
///
/// Throws InputError where a line crosses itself or another, where two points fall together, where
/// a border has fewer than three points or no area, and where spacing is not > 0.
ClothMesh mesh_cloth(const ClothOutline& outline, double spacing_m);

}  // namespace clothfit
