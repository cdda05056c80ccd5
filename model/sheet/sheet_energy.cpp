#include "model/sheet/sheet_energy.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <map>

#include "model/sheet/plate_bending.h"

namespace clothfit {
namespace {

/// The deformation in a cell's middle, its columns dx/ds and dx/dt.
Eigen::Matrix<double, 3, 2> deformation(const ClothCell& cell, const Eigen::Matrix3Xd& position_m) {
  Eigen::Matrix<double, 3, 2> f = Eigen::Matrix<double, 3, 2>::Zero();
  for (int k = 0; k < cell.corners; ++k)
    f += position_m.col(cell.vertex[static_cast<size_t>(k)]) *
         cell.gradient_per_m.col(k).transpose();
  return f;
}

/// Returns a matrix with the rows of both.
BendingMatrix stacked(const BendingMatrix& above, const BendingMatrix& below) {
  if (below.rows() == 0) return above;
  std::vector<Eigen::Triplet<double>> entries;
  for (const auto& [matrix, first] : {std::pair{&above, Eigen::Index{0}}, {&below, above.rows()}})
    for (Eigen::Index row = 0; row < matrix->rows(); ++row)
      for (BendingMatrix::InnerIterator it(*matrix, row); it; ++it)
        entries.emplace_back(first + row, it.col(), it.value());
  BendingMatrix all(above.rows() + below.rows(), above.cols());
  all.setFromTriplets(entries.begin(), entries.end());
  return all;
}

}  // namespace

SheetEnergy::SheetEnergy(const ClothMesh& mesh, const MeasuredFabric& fabric,
                         const std::vector<bool>& clamped)
    : SheetEnergy(mesh, std::vector{fabric},
                  std::vector<int>(static_cast<size_t>(mesh.vertex_count()), 0), clamped) {}

SheetEnergy::SheetEnergy(const ClothMesh& mesh, const std::vector<MeasuredFabric>& fabrics,
                         const std::vector<int>& fabric_of, const std::vector<bool>& clamped,
                         const BendingMatrix& further_bending)
    : mesh_(mesh),
      bending_(stacked(bending_matrix(mesh, fabrics, fabric_of, clamped), further_bending)),
      turned_bending_(bending_.transpose()),
      flat_m_(Eigen::Matrix3Xd::Zero(3, mesh.vertex_count())),
      mass_kg_(mesh.area_m2) {
  flat_m_.topRows<2>() = mesh.material_m;
  for (int v = 0; v < mesh.vertex_count(); ++v)
    mass_kg_[v] *=
        fabrics[static_cast<size_t>(fabric_of[static_cast<size_t>(v)])].areal_density_kg_per_m2;
  for (const MeasuredFabric& fabric : fabrics) {
    const FabricFibres stiffness = fibres_of(fabric).fibres;
    const double diagonal = std::sqrt(0.5);
    fibres_.push_back({{{{1, 0}, stiffness.weft_n_per_m},
                        {{0, 1}, stiffness.warp_n_per_m},
                        {{diagonal, diagonal}, stiffness.bias_n_per_m},
                        {{diagonal, -diagonal}, stiffness.bias_n_per_m}}});
  }
  for (const ClothCell& cell : mesh.cells)
    fabric_of_cell_.push_back(fabric_of[static_cast<size_t>(cell.vertex[0])]);

  std::map<std::array<int, 2>, double> bending;
  for (int v = 0; v < mesh.vertex_count(); ++v) bending[{v, v}] = 0;
  const Eigen::SparseMatrix<double> squared = turned_bending_ * bending_;
  for (int column = 0; column < squared.outerSize(); ++column)
    for (Eigen::SparseMatrix<double>::InnerIterator it(squared, column); it; ++it)
      if (it.row() >= column) bending[{column, static_cast<int>(it.row())}] = it.value();
  const auto between = [](int a, int b) { return std::array{std::min(a, b), std::max(a, b)}; };
  for (const ClothCell& cell : mesh.cells)
    for (size_t a = 0; a < static_cast<size_t>(cell.corners); ++a)
      for (size_t b = 0; b <= a; ++b) bending.try_emplace(between(cell.vertex[a], cell.vertex[b]));

  std::map<std::array<int, 2>, int> number;
  for (const auto& [pair, stiffness_n_per_m] : bending) {
    number[pair] = static_cast<int>(pairs_.size());
    pairs_.push_back({pair[0], pair[1]});
    bending_of_pair_.push_back(stiffness_n_per_m);
  }
  for (const ClothCell& cell : mesh.cells) {
    std::array<int, 10> of{};
    size_t next = 0;
    for (size_t a = 0; a < static_cast<size_t>(cell.corners); ++a)
      for (size_t b = 0; b <= a; ++b)
        of[next++] = number.at(between(cell.vertex[a], cell.vertex[b]));
    pairs_of_cell_.push_back(of);
  }
}

double SheetEnergy::energy_and_gradient(const Eigen::Matrix3Xd& position_m,
                                        Eigen::Matrix3Xd& gradient_n) const {
  const Eigen::MatrixX3d bent = bending_ * (position_m - flat_m_).transpose();
  gradient_n = (turned_bending_ * bent).transpose();
  double energy_j = 0.5 * bent.squaredNorm();
  gradient_n.noalias() -= gravity_m_per_s2_ * mass_kg_.transpose();
  energy_j -= gravity_m_per_s2_.dot(position_m * mass_kg_);
  for (size_t c = 0; c < mesh_.cells.size(); ++c) {
    const ClothCell& cell = mesh_.cells[c];
    const Eigen::Matrix<double, 3, 2> f = deformation(cell, position_m);
    Eigen::Matrix<double, 3, 2> by_f = Eigen::Matrix<double, 3, 2>::Zero();
    for (const Fibre& fibre : fibres(c)) {
      const Eigen::Vector3d along = f * fibre.direction;
      const double stretch = along.norm();
      if (stretch == 0) continue;  // without a direction it pulls at nothing
      const double stiffness = cell.area_m2 * fibre.stiffness_n_per_m;
      energy_j += 0.5 * stiffness * (stretch - 1) * (stretch - 1);
      by_f += stiffness * (1 - 1 / stretch) * along * fibre.direction.transpose();
    }
    for (int k = 0; k < cell.corners; ++k)
      gradient_n.col(cell.vertex[static_cast<size_t>(k)]) += by_f * cell.gradient_per_m.col(k);
  }
  return energy_j;
}

void SheetEnergy::second_derivative(const Eigen::Matrix3Xd& position_m, Curvature curvature,
                                    std::vector<Eigen::Matrix3d>& blocks) const {
  blocks.resize(pairs_.size());
  for (size_t p = 0; p < pairs_.size(); ++p)
    blocks[p] = bending_of_pair_[p] * Eigen::Matrix3d::Identity();
  for (size_t c = 0; c < mesh_.cells.size(); ++c) {
    const ClothCell& cell = mesh_.cells[c];
    const Eigen::Matrix<double, 3, 2> f = deformation(cell, position_m);
    for (const Fibre& fibre : fibres(c)) {
      const Eigen::Vector3d along = f * fibre.direction;
      const double stretch = along.norm();
      if (stretch == 0) continue;
      const double stiffness = cell.area_m2 * fibre.stiffness_n_per_m;
      double transverse = stiffness * (1 - 1 / stretch);
      if (curvature == Curvature::clamped) transverse = std::max(transverse, 0.0);
      const Eigen::Vector3d u = along / stretch;
      const Eigen::Matrix3d block =
          transverse * Eigen::Matrix3d::Identity() + (stiffness - transverse) * u * u.transpose();
      const Eigen::Vector4d weight = cell.gradient_per_m.transpose() * fibre.direction;
      size_t next = 0;
      for (int a = 0; a < cell.corners; ++a)
        for (int b = 0; b <= a; ++b)
          blocks[static_cast<size_t>(pairs_of_cell_[c][next++])] += weight[a] * weight[b] * block;
    }
  }
}

}  // namespace clothfit
