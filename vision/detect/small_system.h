#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace clothfit {

/// A system of few linear equations with a positive definite matrix A and several right sides,
/// solved by Cholesky's method. Sizes known at compile time make it several times as fast as
/// Eigen's.
template <std::size_t unknowns, std::size_t sides>
struct SmallSystem {
  /// Rows of A, of which what stands left of the diagonal is not used, and of the right sides.
  /// After `eliminate` rows of L' and of L^-1 times the right sides, A being L L'.
  std::array<std::array<double, unknowns + sides>, unknowns> rows{};

  double& right(std::size_t row, std::size_t side) { return rows[row][unknowns + side]; }

  void eliminate() {
    for (std::size_t k = 0; k < unknowns; ++k) {
      const double inverse = 1 / std::sqrt(rows[k][k]);
      for (double& one : rows[k]) one *= inverse;
      for (std::size_t row = k + 1; row < unknowns; ++row) {
        const double factor = rows[k][row];
        // From an even number on, so that compilers take two at once.
        for (std::size_t j = row / 2 * 2; j < unknowns + sides; ++j)
          rows[row][j] -= factor * rows[k][j];
      }
    }
  }

  /// Turns a right side into the solution, after `eliminate`.
  void substitute(std::size_t side) {
    for (std::size_t k = unknowns; k-- > 0;) {
      const double value = right(k, side) /= rows[k][k];
      for (std::size_t row = 0; row < k; ++row) right(row, side) -= rows[row][k] * value;
    }
  }
};

}  // namespace clothfit
