#pragma once

#include <Eigen/Core>
#include <vector>

namespace clothfit {

/// Symmetric equations of a chain of blocks, each coupled to the next and all to a border. They are
/// the normal equations of shooting, whose windows are the chain and whose parameters the border.
///
///   [ D0  N0           E0 ] [ x0 ]   [ b0 ]
///   [ N0' D1  N1       E1 ] [ x1 ]   [ b1 ]
///   [     N1' ..  ..   .. ] [ .. ] = [ .. ]
///   [ E0' E1' ..       A  ] [ y  ]   [ c  ]
///
/// Shapes: block k has n_k rows, n_k >= 0; the border p.
struct BorderedChain {
  std::vector<Eigen::MatrixXd> diagonal;   ///< D, n_k x n_k
  std::vector<Eigen::MatrixXd> next;       ///< N, n_k x n_(k + 1); one fewer than blocks
  std::vector<Eigen::MatrixXd> to_border;  ///< E, n_k x p
  Eigen::MatrixXd border;                  ///< A, p x p
  std::vector<Eigen::VectorXd> right;      ///< b
  Eigen::VectorXd border_right;            ///< c
};

struct BorderedChainSolution {
  std::vector<Eigen::VectorXd> blocks;  ///< x
  Eigen::VectorXd border;               ///< y
};

/// Eliminates block after block, then solves the reduced equations of the border. The work grows
/// with the number of blocks, not with its cube. The matrix must be positive definite. Where it is
/// not, the solution may not be finite and is not to be used.
BorderedChainSolution solve(BorderedChain chain);

}  // namespace clothfit
