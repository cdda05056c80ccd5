#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <vector>

#include "model/cloth/cloth.h"
#include "model/rest/mesh_field.h"

namespace clothfit {

/// Held points as linear constraints A x = target. A holds their weights on the vertices, the same
/// for each coordinate.
class HeldProjection {
 public:
  HeldProjection(const Mesh& mesh, const std::vector<HeldVertexWeights>& held);

  int count() const { return static_cast<int>(held_.size()); }
  const std::vector<HeldVertexWeights>& held() const { return held_; }
  /// Returns the vertices with a weight in any held point, rising.
  const std::vector<int>& touched() const { return touched_; }
  /// Returns A: held x touched.
  const Eigen::MatrixXd& weights() const { return weights_; }

  /// Removes from `field` the part that moves held points, or holds them up: v -= A' (A A')^-1 A v.
  /// Vertices that are held themselves, the common case, become zero exactly.
  void project(MeshField& field) const;

  /// Applies the smallest displacement that brings the held points to `target_m` (3 x held). Points
  /// that contradict one another meet in between.
  void place(const Eigen::Matrix3Xd& target_m, MeshField& position_m) const;

  /// Returns where the held points are: 3 x held.
  Eigen::Matrix3Xd locate(const MeshField& position_m) const;

 private:
  std::vector<HeldVertexWeights> held_;
  std::vector<int> touched_;
  Eigen::MatrixXd weights_;
  Eigen::MatrixXd lift_;        ///< A' (A A')^-1: touched x held
  Eigen::MatrixXd projection_;  ///< I - A' (A A')^-1 A: touched x touched
};

/// Returns the motions that held points allow, one per column: 3 vertices x free. Coordinate c of
/// vertex v is in row 3 v + c. Vertices that no held point touches move by themselves.
Eigen::SparseMatrix<double> allowed_motions(const HeldProjection& held, int vertices);

}  // namespace clothfit
