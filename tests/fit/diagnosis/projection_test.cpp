// Taking out of residuals what a model may still move, and what columns explain of the rest.
#include "fit/diagnosis/projection.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <limits>
#include <random>

namespace clothfit {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

Eigen::MatrixXd random_matrix(Eigen::Index rows, Eigen::Index columns, unsigned seed) {
  std::mt19937_64 rng(seed);
  std::normal_distribution<double> normal;
  return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return normal(rng); });
}

Eigen::VectorXd ends(Eigen::Index size, double value) {
  return Eigen::VectorXd::Constant(size, value);
}

TEST(Projection, LeavesTheResidualsOfLeastSquares) {
  const Eigen::MatrixXd jacobian = random_matrix(40, 4, 1);
  const Eigen::VectorXd residual = random_matrix(40, 1, 2);
  const Eigen::VectorXd weight = random_matrix(40, 1, 3).cwiseAbs2();
  const Projection projection(jacobian, Eigen::MatrixXd::Zero(4, 4), Eigen::VectorXd::Zero(4),
                              Eigen::MatrixXd(40, 0), weight, residual);

  const Eigen::VectorXd root = weight.cwiseSqrt();
  const Eigen::MatrixXd a = root.asDiagonal() * jacobian;
  const Eigen::VectorXd b = root.cwiseProduct(residual);
  const Eigen::VectorXd left = b - a * a.colPivHouseholderQr().solve(b);

  EXPECT_LT((projection.residual().head(40) - left).norm(), 1e-9 * left.norm());
  EXPECT_LT((a.transpose() * projection.columns(residual).topRows(40)).norm(), 1e-9 * left.norm());
  EXPECT_NEAR(projection.taken(), 4, 1e-9);
  EXPECT_NEAR(projection.weights(), weight.sum(), 1e-12 * weight.sum());
}

// Directions of unit variance are a covariance I + E E': amounts found with them are those of
// generalised least squares.
TEST(Projection, CountsUnitDirectionsAsACovariance) {
  const Eigen::MatrixXd jacobian = random_matrix(30, 3, 4), errs = 3 * random_matrix(30, 2, 5);
  const Eigen::MatrixXd effect = random_matrix(30, 2, 6);
  const Eigen::VectorXd residual = random_matrix(30, 1, 7);
  const Projection projection(jacobian, Eigen::MatrixXd::Zero(3, 3), Eigen::VectorXd::Zero(3), errs,
                              Eigen::VectorXd::Ones(30), residual);
  const Explained explained = explain(projection.residual(), projection.columns(effect),
                                      ends(2, -kInfinite), ends(2, kInfinite));

  const Eigen::MatrixXd inverse =
      (Eigen::MatrixXd::Identity(30, 30) + errs * errs.transpose()).inverse();
  Eigen::MatrixXd all(30, 5);
  all << jacobian, effect;
  const Eigen::VectorXd expected =
      -(all.transpose() * inverse * all).ldlt().solve(all.transpose() * inverse * residual);

  EXPECT_LT((explained.amount - expected.tail(2)).norm(), 1e-8 * expected.tail(2).norm());
  const double fall = residual.dot(inverse * residual) -
                      (residual + all * expected).dot(inverse * (residual + all * expected)) -
                      (residual.dot(inverse * residual) - projection.residual().squaredNorm());
  EXPECT_NEAR(explained.fall, fall, 1e-8 * projection.residual().squaredNorm());
}

TEST(Projection, LeavesNothingOfWhatTheModelCanDoItself) {
  const Eigen::MatrixXd jacobian = random_matrix(40, 4, 8);
  const Projection projection(jacobian, Eigen::MatrixXd::Zero(4, 4), Eigen::VectorXd::Zero(4),
                              Eigen::MatrixXd(40, 0), Eigen::VectorXd::Ones(40),
                              random_matrix(40, 1, 9));

  EXPECT_EQ(projection.columns(jacobian * random_matrix(4, 2, 10)).norm(), 0);
}

TEST(Explain, FindsTheAmountsAndTheFall) {
  const Eigen::MatrixXd columns = random_matrix(50, 3, 11);
  const Eigen::Vector3d amounts(0.5, -2, 1);
  const Eigen::VectorXd residual = -columns * amounts;
  const Explained explained = explain(residual, columns, ends(3, -kInfinite), ends(3, kInfinite));

  EXPECT_LT((explained.amount - amounts).norm(), 1e-4);
  EXPECT_NEAR(explained.fall, residual.squaredNorm(), 1e-8 * residual.squaredNorm());
}

// Drag cannot be negative: what asks for that is explained by nothing, and others do not lean on
// it.
TEST(Explain, KeepsAmountsWithinTheirEnds) {
  const Eigen::MatrixXd columns = random_matrix(50, 2, 12);
  const Eigen::VectorXd residual = -columns * Eigen::Vector2d(-1, 3);
  const Explained explained = explain(residual, columns, ends(2, 0), ends(2, kInfinite));

  const double alone = -columns.col(1).dot(residual) / columns.col(1).squaredNorm();
  EXPECT_EQ(explained.amount[0], 0);
  EXPECT_NEAR(explained.amount[1], alone, 1e-9);
  EXPECT_NEAR(explained.fall, alone * alone * columns.col(1).squaredNorm(), 1e-6);
}

}  // namespace
}  // namespace clothfit
