#pragma once

#include <Eigen/Core>
#include <vector>

#include "model/sheet/block_energy.h"

namespace clothfit {

/// Factorises symmetric matrices of 3 x 3 blocks, L L', that have the same pattern again and again:
/// the multifrontal method [duff1983] with supernodes [liu1992], on Eigen's dense kernels. It does
/// what Eigen::SimplicialLLT does, on the meshes here three to five times as fast, and like that
/// gives the same bits on every machine: no BLAS takes part.
class BlockCholesky {
 public:
  using Pair = BlockEnergy::Pair;

  /// `pairs` are the blocks in and below the diagonal, [high, low], all of the diagonal among them.
  BlockCholesky(int points, const std::vector<Pair>& pairs);

  /// Factorises the matrix with these blocks, one for each pair. Says whether it is positive
  /// definite; if not, there are no factors.
  bool factorise(const std::vector<Eigen::Matrix3d>& blocks);

  /// Returns the solution for a right side of three numbers per point.
  Eigen::VectorXd solve(const Eigen::VectorXd& right) const;

  /// Returns how many numbers the factor has, zeros that supernodes store included.
  double stored_numbers() const;

 private:
  /// Columns of the factor that have the same rows below them, and are handled as one dense block.
  struct Front {
    int first = 0, columns = 0;  ///< points in the order of elimination
    std::vector<int> rows;       ///< points below, sorted
    double zeros = 0;            ///< blocks that are stored and zero
    int parent = -1;
    std::vector<int> in_parent;  ///< place of each row among the parent's columns and rows
    std::vector<int> children;
    int points() const { return columns + static_cast<int>(rows.size()); }
  };
  /// Where a block of the matrix goes.
  struct Place {
    int front = 0, row = 0, column = 0;
    bool turned = false;
  };
  void make_fronts(const std::vector<std::vector<int>>& below, const std::vector<int>& parent);
  void find_places(const std::vector<Pair>& pairs);
  int place_in(const Front& front, int point) const;

  std::vector<int> order_;  ///< of elimination, of every point
  std::vector<Front> fronts_;
  std::vector<std::vector<int>> pairs_of_;  ///< of each front
  std::vector<Place> place_;                ///< of each pair
  std::vector<Eigen::MatrixXd> panel_;      ///< of each front: its columns of the factor
};

}  // namespace clothfit
