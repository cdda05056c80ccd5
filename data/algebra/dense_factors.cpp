#include "data/algebra/dense_factors.h"

#include <Eigen/Dense>
#include <cassert>

namespace clothfit {

SymmetricEigen symmetric_eigen(const Eigen::MatrixXd& matrix) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(matrix);
  return {.values = solver.eigenvalues(), .vectors = solver.eigenvectors()};
}

Eigen::VectorXd symmetric_eigenvalues(const Eigen::MatrixXd& matrix) {
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(matrix, Eigen::EigenvaluesOnly)
      .eigenvalues();
}

SymmetricFactors::SymmetricFactors(const Eigen::MatrixXd& matrix) : factors_(matrix) {}

bool SymmetricFactors::is_positive_definite() const {
  return factors_.isPositive() && factors_.vectorD().minCoeff() > 0;
}

Eigen::VectorXd SymmetricFactors::solve_vector(const Eigen::VectorXd& right) const {
  return factors_.solve(right);
}

Eigen::MatrixXd SymmetricFactors::solve_matrix(const Eigen::MatrixXd& right) const {
  return factors_.solve(right);
}

CholeskyFactors::CholeskyFactors(const Eigen::MatrixXd& matrix) : factors_(matrix) {}

bool CholeskyFactors::usable() const {
  return factors_.info() == Eigen::Success;
}

double CholeskyFactors::reciprocal_condition() const {
  return factors_.rcond();
}

Eigen::VectorXd CholeskyFactors::solve_vector(const Eigen::VectorXd& right) const {
  return factors_.solve(right);
}

Eigen::MatrixXd CholeskyFactors::solve_matrix(const Eigen::MatrixXd& right) const {
  return factors_.solve(right);
}

Eigen::MatrixXd CholeskyFactors::inverse_lower() const {
  return factors_.matrixL().solve(Eigen::MatrixXd::Identity(factors_.rows(), factors_.cols()));
}

PivotedQr::PivotedQr(const Eigen::MatrixXd& matrix) : factors_(matrix) {}

Eigen::Index PivotedQr::rank() const {
  return factors_.rank();
}

Eigen::MatrixXd PivotedQr::first_of_q(Eigen::Index columns) const {
  return factors_.householderQ() * Eigen::MatrixXd::Identity(factors_.rows(), columns);
}

Eigen::MatrixXd PivotedQr::inverse_r() const {
  const Eigen::Index n = factors_.cols();
  assert(rank() == n);
  const Eigen::MatrixXd inverse =
      factors_.matrixR().topLeftCorner(n, n).triangularView<Eigen::Upper>().solve(
          Eigen::MatrixXd::Identity(n, n));
  return factors_.colsPermutation() * inverse;
}

Eigen::VectorXd PivotedQr::times_q_transposed(const Eigen::VectorXd& right) const {
  return factors_.householderQ().adjoint() * right;
}

Eigen::VectorXd PivotedQr::solve_vector(const Eigen::VectorXd& right) const {
  return factors_.solve(right);
}

Eigen::MatrixXd PivotedQr::solve_matrix(const Eigen::MatrixXd& right) const {
  return factors_.solve(right);
}

Eigen::MatrixXd PivotedQr::solve_matrix(const Rows& right) const {
  return factors_.solve(right);
}

LeastNormFactors::LeastNormFactors(const Eigen::MatrixXd& matrix) : factors_(matrix) {}

Eigen::Index LeastNormFactors::rank() const {
  return factors_.rank();
}

Eigen::MatrixXd LeastNormFactors::pseudo_inverse() const {
  return factors_.pseudoInverse();
}

Eigen::VectorXd LeastNormFactors::solve_vector(const Eigen::VectorXd& right) const {
  return factors_.solve(right);
}

Eigen::MatrixXd LeastNormFactors::solve_matrix(const Eigen::MatrixXd& right) const {
  return factors_.solve(right);
}

Eigen::MatrixXd null_space(const Eigen::MatrixXd& matrix) {
  return matrix.fullPivLu().kernel();
}

SingularVectors left_singular_vectors(const Eigen::MatrixXd& matrix) {
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(matrix, Eigen::ComputeFullU);
  return {.values = svd.singularValues(), .vectors = svd.matrixU()};
}

SingularVectors right_singular_vectors(const Eigen::MatrixXd& matrix) {
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(matrix, Eigen::ComputeFullV);
  return {.values = svd.singularValues(), .vectors = svd.matrixV()};
}

}  // namespace clothfit
