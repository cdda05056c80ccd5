#pragma once

// Eigen's decompositions of dense matrices cost seconds of compiling in every unit that uses them.
// Behind these names they are compiled once.

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/QR>

namespace clothfit {

/// Eigenvalues of a symmetric matrix, rising, and their unit vectors as columns.
struct SymmetricEigen {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
};

/// Decomposes a symmetric matrix; looks at its lower triangle only.
SymmetricEigen symmetric_eigen(const Eigen::MatrixXd& matrix);

/// Returns the eigenvalues, rising.
Eigen::VectorXd symmetric_eigenvalues(const Eigen::MatrixXd& matrix);

namespace internal {

/// Solves for right sides that are vectors (n) or matrices (n x m), each by its own routine. Rows
/// are solved as rows where a class knows how: Eigen's sums, and so the last bit, depend on it.
template <class Factors>
class Solves {
 public:
  template <class Right>
  auto solve(const Eigen::MatrixBase<Right>& right) const {
    const auto& self = static_cast<const Factors&>(*this);
    if constexpr (Right::ColsAtCompileTime == 1)
      return self.solve_vector(right);
    else
      return self.solve_matrix(right.derived().eval());
  }
};

}  // namespace internal

/// L D L' of a symmetric matrix that is positive or negative semidefinite.
class SymmetricFactors : public internal::Solves<SymmetricFactors> {
 public:
  SymmetricFactors() = default;
  explicit SymmetricFactors(const Eigen::MatrixXd& matrix);

  /// Says whether all of D is above 0.
  bool is_positive_definite() const;
  Eigen::VectorXd solve_vector(const Eigen::VectorXd& right) const;
  Eigen::MatrixXd solve_matrix(const Eigen::MatrixXd& right) const;

 private:
  Eigen::LDLT<Eigen::MatrixXd> factors_;
};

/// L L' of a symmetric positive definite matrix.
class CholeskyFactors : public internal::Solves<CholeskyFactors> {
 public:
  CholeskyFactors() = default;
  explicit CholeskyFactors(const Eigen::MatrixXd& matrix);

  /// Says whether the matrix was positive definite. If it was not, nothing else may be asked.
  bool usable() const;
  /// Estimates the reciprocal of the condition number.
  double reciprocal_condition() const;
  Eigen::VectorXd solve_vector(const Eigen::VectorXd& right) const;
  Eigen::MatrixXd solve_matrix(const Eigen::MatrixXd& right) const;
  Eigen::MatrixXd inverse_lower() const;  ///< L^-1

 private:
  Eigen::LLT<Eigen::MatrixXd> factors_;
};

/// A P = Q R of a matrix of any shape, with column pivots. Solves least squares.
class PivotedQr : public internal::Solves<PivotedQr> {
 public:
  explicit PivotedQr(const Eigen::MatrixXd& matrix);

  Eigen::Index rank() const;
  Eigen::MatrixXd first_of_q(Eigen::Index columns) const;
  Eigen::MatrixXd inverse_r() const;  ///< P R^-1; of full rank only
  Eigen::VectorXd times_q_transposed(const Eigen::VectorXd& right) const;
  Eigen::VectorXd solve_vector(const Eigen::VectorXd& right) const;
  Eigen::MatrixXd solve_matrix(const Eigen::MatrixXd& right) const;
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  Eigen::MatrixXd solve_matrix(const Rows& right) const;

 private:
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> factors_;
};

/// Solves least squares with the solution of least norm, whatever the rank.
class LeastNormFactors : public internal::Solves<LeastNormFactors> {
 public:
  explicit LeastNormFactors(const Eigen::MatrixXd& matrix);

  Eigen::Index rank() const;
  Eigen::MatrixXd pseudo_inverse() const;  ///< Moore and Penrose's
  Eigen::VectorXd solve_vector(const Eigen::VectorXd& right) const;
  Eigen::MatrixXd solve_matrix(const Eigen::MatrixXd& right) const;

 private:
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> factors_;
};

/// Returns columns that span the null space; one column of zeros where that is empty.
Eigen::MatrixXd null_space(const Eigen::MatrixXd& matrix);

/// Singular values, falling, and vectors of one side as columns of a square matrix.
struct SingularVectors {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
};

SingularVectors left_singular_vectors(const Eigen::MatrixXd& matrix);
SingularVectors right_singular_vectors(const Eigen::MatrixXd& matrix);

}  // namespace clothfit
