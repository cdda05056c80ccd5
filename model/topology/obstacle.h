#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <utility>
#include <vector>

namespace clothfit {

/// A surface of triangles in the world (m). Corners run counterclockwise as seen from the free
/// side.
struct TriangleMesh {
  Eigen::Matrix3Xd vertex_m;
  Eigen::Matrix3Xi triangle;  ///< indices of vertices, 0 the first
};

/// A resting body that cloth cannot pass. It keeps what finds the nearest point of its surface
/// fast: a tree of boxes, and whether edges and corners are seen from outside.
class Obstacle {
 public:
  /// `reach_m` says how far below the surface a point still belongs to this side of it. It is more
  /// than cloth ever sinks in, less than the thickness of the body behind. Vertices in the same
  /// place are the same vertex; triangles without area are left out. Indices must be those of
  /// vertices.
  explicit Obstacle(const TriangleMesh& mesh, double reach_m = 0.05);

  /// The part of the surface that is nearest to a point below it.
  struct Nearest {
    enum Kind { face, edge, corner };
    Kind kind = face;
    Eigen::Vector3d place_m;    ///< on it: the nearest point
    Eigen::Vector3d direction;  ///< a face's outward normal, an edge's direction: unit vectors
  };
  /// Returns the nearest part of the surface. Nothing where the point is on the free side, deeper
  /// than the reach, or beyond the border of a surface that is not closed.
  std::optional<Nearest> beneath(const Eigen::Vector3d& point_m) const;

  /// How far a point is from the surface.
  struct Distance {
    double distance_m = 0;     ///< < 0 below the surface
    Eigen::Vector3d outwards;  ///< its gradient: a unit vector
    Eigen::Vector3d place_m;   ///< the nearest point of the surface
  };
  /// Returns the distance where it is not more than `within_m`, above and below; there the reach
  /// does not matter. Beyond the border of a surface that is not closed its sign means nothing.
  std::optional<Distance> distance(const Eigen::Vector3d& point_m, double within_m) const;
  /// A distance within which every surface is.
  static constexpr double kAnywhere_m = 1e6;

  /// Returns how many edges do not lie between triangles that face the same way, as many on one
  /// side as on the other: none where the surface is closed.
  int open_edges() const { return open_edges_; }
  /// Returns the volume inside of a closed surface (m3), < 0 where its triangles face inwards.
  double volume_m3() const;

  /// Returns the lower and upper corner of the box around it; zero without triangles.
  std::pair<Eigen::Vector3d, Eigen::Vector3d> bounds_m() const {
    if (nodes_.empty()) return {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
    return {nodes_[0].low, nodes_[0].high};
  }

  int triangles() const { return static_cast<int>(triangles_.size()); }

 private:
  struct Rim {
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< outwards, mean of its faces, not unit
    bool border = false;                               ///< of a surface that is not closed
  };
  struct Triangle {
    std::array<Eigen::Vector3d, 3> corner;
    Eigen::Vector3d normal;
    std::array<int, 3> edge_rim, corner_rim;  ///< edge n runs from corner n to the next
  };
  struct Node {
    Eigen::Vector3d low, high;
    int first = 0;  ///< a leaf's first triangle, otherwise the second child; the first comes next
    int count = 0;  ///< 0 unless a leaf
  };
  void build_tree(int first, int last);
  /// The nearest part of the surface and what says which side of it is outside.
  struct Found {
    Nearest nearest;
    const Rim* rim = nullptr;  ///< of an edge or corner
    const Eigen::Vector3d& outwards() const { return rim ? rim->normal : nearest.direction; }
  };
  std::optional<Found> search(const Eigen::Vector3d& point_m, double within_m) const;

  double reach_m_;
  int open_edges_ = 0;
  std::vector<Triangle> triangles_;
  std::vector<Rim> rims_;
  std::vector<Node> nodes_;
};

}  // namespace clothfit
