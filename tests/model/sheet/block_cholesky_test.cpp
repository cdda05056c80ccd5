// Checks the factorisation of block matrices against Eigen's dense one.

#include "model/sheet/block_cholesky.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <random>

namespace clothfit {
namespace {

/// A matrix with blocks between neighbours of a grid, two steps away too, and the same dense.
struct BlockMatrix {
  int points = 0;
  std::vector<BlockCholesky::Pair> pairs;
  std::vector<Eigen::Matrix3d> blocks;
  Eigen::MatrixXd dense;

  BlockMatrix(int columns, int rows, double diagonal, unsigned seed) : points(columns * rows) {
    std::mt19937 random(seed);
    const auto draw = [&] { return static_cast<double>(random()) / 0x1p31 - 1; };
    dense = Eigen::MatrixXd::Zero(3 * points, 3 * points);
    for (int a = 0; a < points; ++a)
      for (int b = a; b < points; ++b) {
        const int across = std::abs(a % columns - b % columns), up = b / columns - a / columns;
        if (across + up > 2) continue;
        Eigen::Matrix3d block;
        for (double& x : block.reshaped()) x = draw();
        if (a == b) {
          block = (block + block.transpose()).eval();
          block.diagonal().array() += diagonal;
        }
        pairs.push_back({a, b});
        blocks.push_back(block);
        dense.block<3, 3>(3 * b, 3 * a) = block;
        dense.block<3, 3>(3 * a, 3 * b) = block.transpose();
      }
  }
};

TEST(BlockCholesky, SolvesAsADenseFactorisation) {
  for (const auto& [columns, rows] : {std::pair{1, 1}, {2, 1}, {40, 1}, {7, 9}, {20, 13}}) {
    const BlockMatrix matrix(columns, rows, 30, 7);
    BlockCholesky factors(matrix.points, matrix.pairs);
    ASSERT_TRUE(factors.factorise(matrix.blocks));
    Eigen::VectorXd right(3 * matrix.points);
    std::mt19937 random(3);
    for (double& x : right) x = static_cast<double>(random()) / 0x1p31 - 1;
    const Eigen::VectorXd expected = matrix.dense.llt().solve(right);
    EXPECT_LT((factors.solve(right) - expected).norm(), 1e-13 * expected.norm() * matrix.points);
    // Again, with other numbers in the same pattern.
    std::vector<Eigen::Matrix3d> doubled = matrix.blocks;
    for (Eigen::Matrix3d& block : doubled) block *= 2;
    ASSERT_TRUE(factors.factorise(doubled));
    EXPECT_LT((2 * factors.solve(right) - expected).norm(),
              1e-13 * expected.norm() * matrix.points);
  }
}

TEST(BlockCholesky, SaysWhetherAMatrixIsPositiveDefinite) {
  // From clearly indefinite to clearly definite, as the dense eigenvalues have it.
  int definite = 0;
  for (double diagonal = 0; diagonal < 30; diagonal += 1.5) {
    const BlockMatrix matrix(9, 8, diagonal, 5);
    const double least =
        Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(matrix.dense).eigenvalues()[0];
    BlockCholesky factors(matrix.points, matrix.pairs);
    EXPECT_EQ(factors.factorise(matrix.blocks), least > 0) << least;
    definite += least > 0;
  }
  EXPECT_GT(definite, 3);
  EXPECT_LT(definite, 17);
}

TEST(BlockCholesky, StoresLittleMoreThanTheFactorHas) {
  // A grid's factor grows with n log n under the best order, with n^1.5 (eightfold) row by row.
  const BlockMatrix small(24, 24, 30, 1), large(48, 48, 30, 1);
  const double of_small = BlockCholesky(small.points, small.pairs).stored_numbers(),
               of_large = BlockCholesky(large.points, large.pairs).stored_numbers();
  EXPECT_LT(of_small, 9.0 * small.points * 45);
  EXPECT_LT(of_large / of_small, 7);
}

}  // namespace
}  // namespace clothfit
