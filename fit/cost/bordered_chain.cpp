#include "fit/cost/bordered_chain.h"

#include <cassert>

#include "data/algebra/dense_factors.h"

namespace clothfit {

BorderedChainSolution solve(BorderedChain chain) {
  const size_t blocks = chain.diagonal.size();
  assert(chain.to_border.size() == blocks && chain.right.size() == blocks);
  assert(blocks == 0 || chain.next.size() + 1 == blocks);
  std::vector<SymmetricFactors> factors;
  for (size_t k = 0; k < blocks; ++k) {
    factors.emplace_back(chain.diagonal[k]);
    if (chain.diagonal[k].rows() == 0) continue;
    const Eigen::MatrixXd to_border = factors[k].solve(chain.to_border[k]);
    const Eigen::VectorXd right = factors[k].solve(chain.right[k]);
    chain.border -= chain.to_border[k].transpose() * to_border;
    chain.border_right -= chain.to_border[k].transpose() * right;
    if (k + 1 == blocks) break;
    const Eigen::MatrixXd& next = chain.next[k];
    chain.diagonal[k + 1] -= next.transpose() * factors[k].solve(next);
    chain.to_border[k + 1] -= next.transpose() * to_border;
    chain.right[k + 1] -= next.transpose() * right;
  }
  BorderedChainSolution solution;
  solution.border = SymmetricFactors(chain.border).solve(chain.border_right);
  solution.blocks.resize(blocks);
  for (size_t k = blocks; k-- > 0;) {
    Eigen::VectorXd right = chain.right[k];
    if (right.size() > 0) {
      right -= chain.to_border[k] * solution.border;
      if (k + 1 < blocks) right -= chain.next[k] * solution.blocks[k + 1];
      right = factors[k].solve(right);
    }
    solution.blocks[k] = std::move(right);
  }
  return solution;
}

}  // namespace clothfit
