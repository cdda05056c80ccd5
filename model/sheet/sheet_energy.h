#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <vector>

#include "model/fabric/measured_fabric.h"
#include "model/rest/hanging_energy.h"
#include "model/topology/cloth_mesh.h"

namespace clothfit {

/// Energy of a sheet of fabric of any outline under its weight (J): fibres, plate bending, weight.
///
///   E = sum over cells A sum over fibres c (|F d| - 1)^2 / 2 + bending - sum m g . x
///
/// F is a cell's deformation in its middle, d a fibre's direction in the flat cloth (weft, warp,
/// and both diagonals), c its tension per width and strain. In a square of the lattice the fibres
/// are springs between the middles of opposite sides and between opposite corners: the model's
/// lattice, but for threads that run through the middle of a cell. Threads along its sides would
/// lengthen when the cell twists, and so stiffen coarse meshes against folds that do not run along
/// them.
class SheetEnergy {
 public:
  /// `mesh` must outlive this. `clamped` vertices (one entry per vertex; empty: none) are held with
  /// their slope in the plane of the flat cloth, (s, t) being x and y there. Throws InputError as
  /// fibres_of() does.
  SheetEnergy(const ClothMesh& mesh, const MeasuredFabric& fabric,
              const std::vector<bool>& clamped = {});

  const ClothMesh& mesh() const { return mesh_; }
  const Eigen::VectorXd& mass_kg() const { return mass_kg_; }
  double weight_n() const { return mass_kg_.sum() * gravity_m_per_s2_.norm(); }
  void set_gravity(const Eigen::Vector3d& gravity_m_per_s2) {
    gravity_m_per_s2_ = gravity_m_per_s2;
  }

  /// Returns the energy; its derivative by the positions (3 x vertices, N) goes to `gradient_n`.
  double energy_and_gradient(const Eigen::Matrix3Xd& position_m,
                             Eigen::Matrix3Xd& gradient_n) const;

  /// Pairs of vertices whose forces depend on one another, the second not below the first. They do
  /// not change with the shape.
  struct Pair {
    int low = 0, high = 0;
  };
  const std::vector<Pair>& pairs() const { return pairs_; }
  /// Returns d gradient[high] / d position[low] of every pair, 3 x 3 blocks (N/m).
  void second_derivative(const Eigen::Matrix3Xd& position_m, Curvature curvature,
                         std::vector<Eigen::Matrix3d>& blocks) const;

 private:
  struct Fibre {
    Eigen::Vector2d direction;
    double stiffness_n_per_m = 0;
  };

  const ClothMesh& mesh_;
  std::vector<Fibre> fibres_;
  Eigen::SparseMatrix<double, Eigen::RowMajor> bending_, turned_bending_;  ///< D and D'
  Eigen::Matrix3Xd flat_m_;                                                ///< the clamps' plane
  Eigen::VectorXd mass_kg_;
  Eigen::Vector3d gravity_m_per_s2_{0, 0, -9.81};
  std::vector<Pair> pairs_;
  std::vector<double> bending_of_pair_;
  std::vector<std::array<int, 10>> pairs_of_cell_;  ///< of corners 00, 10, 11, 20, 21, ..., 33
};

}  // namespace clothfit
