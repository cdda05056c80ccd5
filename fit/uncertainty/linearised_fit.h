#pragma once

#include <Eigen/Core>
#include <vector>

namespace clothfit {

/// A fit near its optimum as plain numbers, whatever its cost. Statistics need no more of it. It
/// has n residuals and p coordinates.
struct LinearisedFit {
  Eigen::VectorXd residual;           ///< whitened, n
  Eigen::MatrixXd jacobian;           ///< d residual / d coordinate, n x p
  Eigen::VectorXd weight;             ///< Huber's, n, 0 ... 1; empty: all 1
  Eigen::MatrixXd prior_information;  ///< of the coordinates, p x p, symmetric; empty: no priors

  int residuals() const { return static_cast<int>(residual.size()); }
  int coordinates() const { return static_cast<int>(jacobian.cols()); }
  /// Throws InputError for numbers that are not finite. Sizes must fit together.
  void validate() const;
};

/// The parts of the normal equations that the blocks of a partition contribute. Linear statistics
/// over blocks need to know no more of the residuals.
struct BlockSums {
  std::vector<Eigen::MatrixXd> information;  ///< of each block, J' W J over its rows, p x p
  Eigen::MatrixXd gradient;                  ///< J' W r of each block, p x blocks
  Eigen::MatrixXd prior_information;         ///< p x p, zero without priors
  Eigen::MatrixXd total_information;         ///< of all blocks and the priors

  int blocks() const { return static_cast<int>(gradient.cols()); }
  int coordinates() const { return static_cast<int>(gradient.rows()); }
};

/// Sums each block's part of the normal equations. `block` gives each residual the index of its
/// block, 0 ... largest, each in use. Throws InputError for fewer than two blocks, and for
/// numbers that are not finite.
BlockSums sum_over_blocks(const LinearisedFit& fit, const Eigen::VectorXi& block);

}  // namespace clothfit
