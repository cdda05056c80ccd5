#include "fit/cost/huber.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "data/median.h"

namespace clothfit {

double robust_scale(const Eigen::VectorXd& residual) {
  std::vector<double> sizes(static_cast<size_t>(residual.size()));
  for (Eigen::Index n = 0; n < residual.size(); ++n)
    sizes[static_cast<size_t>(n)] = std::abs(residual[n]);
  if (sizes.empty()) return 1;
  return std::max(1.0, kMadToSigma * median(std::move(sizes)));
}

Eigen::VectorXd huber_weights(const Objective& objective, const Eigen::VectorXd& residual,
                              double threshold) {
  Eigen::VectorXd weight(residual.size());
  for (const Objective::Block& block : objective.blocks()) {
    const double length = residual.segment(block.offset, block.dimension).norm();
    weight.segment(block.offset, block.dimension)
        .setConstant(std::min(1.0, threshold / std::max(length, 1e-300)));
  }
  return weight;
}

double huber_cost(const Objective& objective, const Eigen::VectorXd& residual, double threshold) {
  if (threshold == std::numeric_limits<double>::infinity()) return 0.5 * residual.squaredNorm();
  double sum = 0;
  for (const Objective::Block& block : objective.blocks()) {
    const double length = residual.segment(block.offset, block.dimension).norm();
    sum += huber_square(length, threshold);
  }
  return 0.5 * sum;
}

}  // namespace clothfit
