// Checks the equations of a chain with a border. Their use by shooting is checked in
// shooting_test.cpp.
#include "fit/cost/bordered_chain.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <random>

namespace clothfit {
namespace {

/// A chain of blocks of these sizes whose matrix is J'J. J has rows that see a block, the next one
/// and the border. Beside it is that matrix as a whole, blocks first.
struct RandomChain {
  BorderedChain chain;
  Eigen::MatrixXd whole;
  Eigen::VectorXd right;

  RandomChain(const std::vector<int>& sizes, int border, unsigned seed) {
    std::mt19937 generator(seed);
    std::normal_distribution<double> normal;
    const auto random = [&](Eigen::Index rows, Eigen::Index columns) {
      return Eigen::MatrixXd(
          Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return normal(generator); }));
    };
    std::vector<int> first{0};
    for (const int size : sizes) first.push_back(first.back() + size);
    const int all = first.back() + border;
    whole = 0.1 * Eigen::MatrixXd::Identity(all, all);
    for (size_t k = 0; k < sizes.size(); ++k) {
      Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(7, all);
      rows.middleCols(first[k], sizes[k]) = random(7, sizes[k]);
      if (k + 1 < sizes.size())
        rows.middleCols(first[k + 1], sizes[k + 1]) = random(7, sizes[k + 1]);
      rows.rightCols(border) = random(7, border);
      whole += rows.transpose() * rows;
    }
    right = random(all, 1);
    for (size_t k = 0; k < sizes.size(); ++k) {
      chain.diagonal.push_back(whole.block(first[k], first[k], sizes[k], sizes[k]));
      if (k + 1 < sizes.size())
        chain.next.push_back(whole.block(first[k], first[k + 1], sizes[k], sizes[k + 1]));
      chain.to_border.push_back(whole.block(first[k], first.back(), sizes[k], border));
      chain.right.push_back(right.segment(first[k], sizes[k]));
    }
    chain.border = whole.bottomRightCorner(border, border);
    chain.border_right = right.tail(border);
  }
};

TEST(BorderedChain, IsSolvedAsTheDenseEquationsAre) {
  for (const std::vector<int>& sizes :
       {std::vector<int>{3, 4, 2, 5}, std::vector<int>{0, 4, 4, 4}, std::vector<int>{6},
        std::vector<int>{0}, std::vector<int>{}}) {
    constexpr unsigned kSeed = 3;
    SCOPED_TRACE("blocks: " + std::to_string(sizes.size()) + ", seed " + std::to_string(kSeed));
    const RandomChain random(sizes, 5, kSeed);

    const BorderedChainSolution solution = solve(random.chain);

    const Eigen::VectorXd expected = random.whole.ldlt().solve(random.right);
    Eigen::VectorXd found(expected.size());
    Eigen::Index at = 0;
    for (const Eigen::VectorXd& block : solution.blocks) {
      found.segment(at, block.size()) = block;
      at += block.size();
    }
    found.tail(5) = solution.border;
    // The condition of the matrix is below 1e4.
    EXPECT_LT((found - expected).norm(), 1e-11 * expected.norm());
  }
}

}  // namespace
}  // namespace clothfit
