#pragma once

#include <Eigen/Cholesky>
#include <array>
#include <memory>
#include <vector>

#include "model/rest/hanging_energy.h"

namespace clothfit {

/// A symmetric 3 x 3 matrix at every vertex: planes xx, yy, zz, xy, xz, yz.
using MatrixPlanes = std::array<Eigen::ArrayXd, 6>;

/// Applies one V-cycle on a lattice of springs. It is a preconditioner for (H + shift M) v = r with
/// H the clamped second derivative of a cloth's energy.
///
/// Coarse lattices take every second vertex and the last of each row and column. Their springs are
/// matrices: each is the mean of the fine ones that it stands for, which a lattice of the same
/// continuum has at any spacing. Corrections go up bilinearly, residuals down by the transpose. The
/// smoother is Chebyshev's polynomials of the matrix, scaled by its 3 x 3 blocks on the diagonal. A
/// network of semidefinite springs scaled so has no eigenvalue above 2, so no estimate is needed.
/// The coarsest lattice is solved by Cholesky's factorisation. The cycle is symmetric and positive
/// definite.
///
/// `fixed` vertices do not move and are not looked at.
class LatticeMultigrid {
 public:
  LatticeMultigrid(const FieldLayout& layout, const std::vector<int>& fixed);
  ~LatticeMultigrid();

  /// Takes the matrix at hand, which must stay as it is while it is applied. `shift_n_per_m` is a
  /// plane of the finest layout, added to the diagonal, > 0 at every vertex.
  void set(const EnergyTangent& clamped, const Eigen::ArrayXd& shift_n_per_m);

  /// Computes approximately v = (H + shift)^-1 r.
  void apply(const MeshField& r, MeshField& v);

 private:
  struct Level;
  void cycle(size_t level);
  std::vector<std::unique_ptr<Level>> levels_;  ///< finest first
  Eigen::LLT<Eigen::MatrixXd> coarsest_;
};

}  // namespace clothfit
