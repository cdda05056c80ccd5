#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "model/topology/obstacle.h"

namespace clothfit {

/// The distance to a body as a smooth function of the place.
///
/// The exact distance has a crease wherever the nearest triangle changes: along every hollow edge
/// of the mesh and in armpits. Here it is sampled on a grid and approximated by quadratic
/// B-splines, whose first derivative is continuous. Their coefficients,
///
///   c = d - (second differences of d along the three axes) / 8,
///
/// reproduce quadratic distances exactly [unser1999]. Creases become bends of a few cells' width.
///
/// Samples are taken in blocks of the grid when a place in them is first asked for: one thread at a
/// time may use it.
class BodyField {
 public:
  /// `body` must outlive this. The cells may become wider than asked for, a thousandth of the body.
  BodyField(const Obstacle& body, double cell_m);

  const Obstacle& exact() const { return body_; }

  struct Distance {
    double distance_m = 0;     ///< < 0 below the surface
    Eigen::Vector3d gradient;  ///< outwards, of length 1 but for where a crease was
    Eigen::Matrix3d per_m;     ///< second derivative; it jumps between cells
  };
  /// Returns the distance at a place less than `within_m` (up to three cells) above the surface, or
  /// anywhere below it.
  /// Elsewhere it returns nothing, and `free_way_m` says how far one can go from there until it
  /// returns something (0: not known).
  std::optional<Distance> near(const Eigen::Vector3d& place_m, double within_m,
                               double& free_way_m) const;

 private:
  static constexpr int kSide = 8;  ///< of a block, in coefficients
  using Block = std::array<double, kSide * kSide * kSide>;
  /// Returns the number of a node's block; -1 outside of the grid and at its border.
  int block_at(const Eigen::Vector3i& node) const;
  const Block& filled(const Eigen::Vector3i& node) const;
  void fill(const Eigen::Vector3i& first_node, Block& block) const;
  Distance evaluate(const Eigen::Vector3d& place_m) const;

  const Obstacle& body_;
  double cell_m_ = 0;
  Eigen::Vector3d low_m_ = Eigen::Vector3d::Zero();
  Eigen::Vector3i blocks_ = Eigen::Vector3i::Zero();
  mutable std::vector<std::unique_ptr<Block>> block_;
};

}  // namespace clothfit
