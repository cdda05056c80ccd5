#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <vector>

#include "model/fabric/measured_fabric.h"
#include "model/sheet/cloth_energy.h"
#include "model/sheet/plate_bending.h"
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
class SheetEnergy : public ClothEnergy {
 public:
  /// `mesh` must outlive this. `clamped` vertices (one entry per vertex; empty: none) are held with
  /// their slope in the plane of the flat cloth, (s, t) being x and y there. Throws InputError as
  /// fibres_of() does.
  SheetEnergy(const ClothMesh& mesh, const MeasuredFabric& fabric,
              const std::vector<bool>& clamped = {});
  /// The same for a cloth of several fabrics: `fabric_of` has one index of `fabrics` per vertex,
  /// the same for all of a cell. The rows of `further_bending` (empty: none) are added to those
  /// of bending_matrix().
  SheetEnergy(const ClothMesh& mesh, const std::vector<MeasuredFabric>& fabrics,
              const std::vector<int>& fabric_of, const std::vector<bool>& clamped = {},
              const BendingMatrix& further_bending = {});

  const ClothMesh& mesh() const { return mesh_; }
  const Eigen::VectorXd& mass_kg() const override { return mass_kg_; }
  double weight_n() const override { return mass_kg_.sum() * gravity_m_per_s2_.norm(); }
  void set_gravity(const Eigen::Vector3d& gravity_m_per_s2) override {
    gravity_m_per_s2_ = gravity_m_per_s2;
  }

  double energy_and_gradient(const Eigen::Matrix3Xd& position_m,
                             Eigen::Matrix3Xd& gradient_n) const override;
  const std::vector<Pair>& pairs() const override { return pairs_; }
  void second_derivative(const Eigen::Matrix3Xd& position_m, Curvature curvature,
                         std::vector<Eigen::Matrix3d>& blocks) const override;

 private:
  struct Fibre {
    Eigen::Vector2d direction;
    double stiffness_n_per_m = 0;
  };

  using Fibres = std::array<Fibre, 4>;
  const Fibres& fibres(size_t cell) const {
    return fibres_[static_cast<size_t>(fabric_of_cell_[cell])];
  }

  const ClothMesh& mesh_;
  std::vector<Fibres> fibres_;  ///< of each fabric
  std::vector<int> fabric_of_cell_;
  Eigen::SparseMatrix<double, Eigen::RowMajor> bending_, turned_bending_;  ///< D and D'
  Eigen::Matrix3Xd flat_m_;                                                ///< the clamps' plane
  Eigen::VectorXd mass_kg_;
  Eigen::Vector3d gravity_m_per_s2_{0, 0, -9.81};
  std::vector<Pair> pairs_;
  std::vector<double> bending_of_pair_;
  std::vector<std::array<int, 10>> pairs_of_cell_;  ///< of corners 00, 10, 11, 20, 21, ..., 33
};

}  // namespace clothfit
