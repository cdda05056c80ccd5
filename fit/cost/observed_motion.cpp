#include "fit/cost/observed_motion.h"

#include <map>

namespace clothfit {

double observed_motion(const Objective& objective) {
  double sum = 0;
  int count = 0;
  std::map<std::pair<int, int>, Eigen::Vector3d> first;  // for each set and marker
  for (const Objective::Block& block : objective.blocks()) {
    if (block.set < 0) continue;
    const Observation& row = objective.problem()
                                 .observations[static_cast<size_t>(block.set)]
                                 .rows[static_cast<size_t>(block.row)];
    const Eigen::Vector3d& from =
        first.try_emplace({block.set, block.marker}, row.observed).first->second;
    sum += (row.observed - from).head(block.dimension).norm() / row.sigma;
    ++count;
  }
  return count > 0 ? sum / count : 0;
}

double cost_of_following(const Objective& objective) {
  constexpr double kShare = 0.05;
  return kShare * observed_motion(objective);
}

}  // namespace clothfit
