// Checks the decompositions' promises: that they solve, and their statements of rank and condition.
// Rounding of Eigen's numbers is Eigen's own to test.

#include "data/algebra/dense_factors.h"

#include <gtest/gtest.h>

#include <cmath>

namespace clothfit {
namespace {

constexpr double kRounding = 1e-13;

/// Returns entries in [-1, 1], the same on every machine.
Eigen::MatrixXd scattered(Eigen::Index rows, Eigen::Index cols) {
  Eigen::MatrixXd matrix(rows, cols);
  for (Eigen::Index i = 0; i < rows; ++i)
    for (Eigen::Index j = 0; j < cols; ++j)
      matrix(i, j) =
          std::sin(1.0 + 3.7 * static_cast<double>(i) + 1.3 * static_cast<double>(i * j));
  return matrix;
}

Eigen::MatrixXd positive(Eigen::Index size) {
  const Eigen::MatrixXd root = scattered(size + 2, size);
  return root.transpose() * root;
}

TEST(SymmetricEigen, RebuildsTheMatrixFromRisingValues) {
  const Eigen::MatrixXd matrix = positive(6);
  const SymmetricEigen eigen = symmetric_eigen(matrix);
  EXPECT_LT((eigen.vectors * eigen.values.asDiagonal() * eigen.vectors.transpose() - matrix).norm(),
            kRounding * matrix.norm());
  for (Eigen::Index k = 1; k < 6; ++k) EXPECT_GE(eigen.values[k], eigen.values[k - 1]);
  EXPECT_LT((symmetric_eigenvalues(matrix) - eigen.values).norm(), kRounding * matrix.norm());
}

TEST(SymmetricFactors, SolveVectorsAndMatricesAndTellWhatIsNotPositive) {
  const Eigen::MatrixXd matrix = positive(5), right = scattered(5, 3);
  const SymmetricFactors factors(matrix);
  EXPECT_TRUE(factors.is_positive_definite());
  EXPECT_LT((matrix * factors.solve(right) - right).norm(), 1e-10);
  EXPECT_LT((matrix * factors.solve(right.col(1)) - right.col(1)).norm(), 1e-10);
  EXPECT_LT((matrix * factors.solve(-2 * right.col(1)) + 2 * right.col(1)).norm(), 1e-10);

  Eigen::MatrixXd saddle = matrix;
  saddle(4, 4) = -1;
  EXPECT_FALSE(SymmetricFactors(saddle).is_positive_definite());
}

TEST(CholeskyFactors, KnowTheConditionAndWhatTheyCannotFactor) {
  const Eigen::MatrixXd matrix = positive(4);
  const CholeskyFactors factors(matrix);
  ASSERT_TRUE(factors.usable());
  const Eigen::MatrixXd inverse_lower = factors.inverse_lower();
  EXPECT_LT(
      (inverse_lower * matrix * inverse_lower.transpose() - Eigen::MatrixXd::Identity(4, 4)).norm(),
      1e-10);
  const Eigen::Vector2d scales(1, 1e-9);
  const Eigen::MatrixXd stretched = scales.asDiagonal();
  EXPECT_NEAR(CholeskyFactors(stretched).reciprocal_condition(), 1e-9, 1e-12);
  EXPECT_FALSE(CholeskyFactors(-matrix).usable());
}

TEST(PivotedQr, SolvesLeastSquaresAndCountsWhatIsIndependent) {
  Eigen::MatrixXd matrix = scattered(7, 3);
  const PivotedQr qr(matrix);
  ASSERT_EQ(qr.rank(), 3);
  const Eigen::VectorXd right = scattered(7, 1);
  EXPECT_LT((matrix.transpose() * (matrix * qr.solve(right) - right)).norm(), 1e-12);
  const Eigen::MatrixXd q = qr.first_of_q(3);
  EXPECT_LT((q.transpose() * q - Eigen::MatrixXd::Identity(3, 3)).norm(), kRounding);
  EXPECT_LT((matrix * qr.inverse_r() - q).norm(), 1e-12);
  EXPECT_LT((qr.times_q_transposed(right).head(3) - q.transpose() * right).norm(), 1e-12);

  matrix.col(2) = matrix.col(0) - 2 * matrix.col(1);
  EXPECT_EQ(PivotedQr(matrix).rank(), 2);
}

TEST(LeastNormFactors, TakeTheShortestOfAllSolutions) {
  Eigen::MatrixXd matrix(1, 2);
  matrix << 3, 4;
  const LeastNormFactors factors(matrix);
  EXPECT_EQ(factors.rank(), 1);
  const Eigen::VectorXd right = Eigen::VectorXd::Constant(1, 25);
  EXPECT_LT((factors.solve(right) - Eigen::Vector2d(3, 4)).norm(), kRounding);
  EXPECT_LT((factors.pseudo_inverse() - Eigen::Vector2d(0.12, 0.16)).norm(), kRounding);
}

TEST(NullSpace, IsWhatAMatrixTakesToNothing) {
  Eigen::MatrixXd matrix(2, 3);
  matrix << 1, 1, 1, 1, 2, 3;
  const Eigen::MatrixXd kernel = null_space(matrix);
  ASSERT_EQ(kernel.cols(), 1);
  EXPECT_GT(kernel.norm(), 0.1);
  EXPECT_LT((matrix * kernel).norm(), kRounding);
  EXPECT_EQ(null_space(Eigen::MatrixXd::Identity(2, 2)).norm(), 0);
}

TEST(SingularVectors, OfBothSidesShareTheirValues) {
  const Eigen::MatrixXd matrix = scattered(3, 5);
  const SingularVectors left = left_singular_vectors(matrix);
  const SingularVectors right = right_singular_vectors(matrix);
  ASSERT_EQ(left.vectors.cols(), 3);
  ASSERT_EQ(right.vectors.cols(), 5);
  for (Eigen::Index k = 0; k < 3; ++k) {
    EXPECT_NEAR(left.values[k], right.values[k], kRounding);
    EXPECT_NEAR((matrix * right.vectors.col(k)).norm(), left.values[k], kRounding);
    EXPECT_NEAR((left.vectors.col(k).transpose() * matrix).norm(), left.values[k], kRounding);
  }
}

}  // namespace
}  // namespace clothfit
