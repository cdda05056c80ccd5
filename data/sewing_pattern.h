#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

namespace clothfit {

/// An edge of a panel's outline, from one corner to the next: a line; a Bezier curve with one
/// control point (quadratic) or two (cubic), in the panel's plane (m); or an arc of a circle.
struct PatternEdge {
  std::vector<Eigen::Vector2d> control_m;
  /// Tangent of a quarter of the arc's angle, > 0 where it bulges to the right of its direction; 0
  /// for what is no arc.
  double bulge = 0;
};

/// Returns the point of an edge at the parameter t from 0 to 1, not evenly along a curve.
inline Eigen::Vector2d edge_point_m(const Eigen::Vector2d& from_m, const PatternEdge& edge,
                                    const Eigen::Vector2d& to_m, double t) {
  const double u = 1 - t;
  if (edge.bulge != 0) {
    // The chord to t, turned and shortened from the whole one: exact for the flattest arcs too.
    const double half_angle = 2 * std::atan(edge.bulge);
    const Eigen::Rotation2Dd turn(-u * half_angle);
    return from_m +
           std::sin(t * half_angle) / std::sin(half_angle) * (turn * (to_m - from_m).eval());
  }
  switch (edge.control_m.size()) {
    case 0:
      return u * from_m + t * to_m;
    case 1:
      return u * u * from_m + 2 * u * t * edge.control_m[0] + t * t * to_m;
    default:
      return u * u * u * from_m + 3 * u * u * t * edge.control_m[0] +
             3 * u * t * t * edge.control_m[1] + t * t * t * to_m;
  }
}

/// A flat piece of cloth as it is cut.
struct Panel {
  std::string name;
  /// The outline, counterclockwise as seen from the garment's outside, without its first corner
  /// again at the end; 2 x corners.
  Eigen::Matrix2Xd corner_m;
  std::vector<PatternEdge> edges;  ///< edge k runs from corner k to the next
  double grain_rad = 0;            ///< of the warp, from the panel's y axis, counterclockwise
  int fabric = 0;                  ///< index of the pattern's fabrics
  /// Takes points (x, y, 0) of the panel to where it waits around the body, its z axis outwards.
  Eigen::Isometry3d placement = Eigen::Isometry3d::Identity();
  int line = 0;  ///< of the pattern's file; 0: not known

  int edge_count() const { return static_cast<int>(edges.size()); }
};

/// One side of a seam: edges of a panel in their order along its outline. Between two of them may
/// lie a dart, which another seam closes.
struct SeamSide {
  int panel = 0;
  std::vector<int> edges;
};

/// Two sides that are sewn together. One runs along its outline and the other against its own, so
/// that the outsides of both panels become one outside.
struct Seam {
  std::array<SeamSide, 2> sides;
  double easing = 0.05;  ///< the longer side may exceed the shorter by this share; it is gathered
  int line = 0;          ///< of the pattern's file; 0: not known
};

/// A garment before it is sewn.
struct Pattern {
  std::string file;  ///< from which it comes; empty: from none
  std::string name;
  std::vector<Panel> panels;
  std::vector<Seam> seams;
  std::vector<std::string> fabrics;  ///< names, of which panels have the indices
  /// The data sheet of each fabric; empty: none is named.
  std::vector<std::filesystem::path> fabric_files;
  std::vector<std::filesystem::path> drawing_files;  ///< that outlines come from
};

}  // namespace clothfit
