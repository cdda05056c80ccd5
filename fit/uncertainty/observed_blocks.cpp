#include "fit/uncertainty/observed_blocks.h"

#include <algorithm>

namespace clothfit {

namespace {

ObservationPlaces places_of(const TrajectoryObjective& objective) {
  const FitProblem& problem = objective.problem();
  ObservationPlaces places;
  places.s_m.resize(objective.residual_count());
  places.t_m.resize(objective.residual_count());
  places.time_s.resize(objective.residual_count());
  places.component.resize(objective.residual_count());
  for (const Objective::Block& block : objective.blocks()) {
    for (int c = 0; c < block.dimension; ++c) {
      places.s_m[block.offset + c] = problem.marker_place_m(0, block.marker);
      places.t_m[block.offset + c] = problem.marker_place_m(1, block.marker);
      places.time_s[block.offset + c] = problem.frame_time_s[static_cast<size_t>(block.frame)];
      places.component[block.offset + c] = c;
    }
  }
  return places;
}

/// Returns the residuals of one set of observations.
std::vector<Eigen::Index> rows_of(const TrajectoryObjective& objective, int set) {
  std::vector<Eigen::Index> rows;
  for (const Objective::Block& block : objective.blocks())
    if (block.set == set)
      for (int c = 0; c < block.dimension; ++c) rows.push_back(block.offset + c);
  return rows;
}

}  // namespace

ObservedBlocks observed_blocks(const TrajectoryObjective& objective,
                               const Eigen::VectorXd& residual) {
  const ObservationPlaces places = places_of(objective);
  const BlockCounts most = BlockLimits().most;
  ObservedBlocks result{.counts = most, .blocks = {}};
  for (size_t s = 0; s < objective.problem().observations.size(); ++s) {
    const std::vector<Eigen::Index> rows = rows_of(objective, static_cast<int>(s));
    if (rows.empty()) continue;
    const ObservationPlaces own{.s_m = places.s_m(rows),
                                .t_m = places.t_m(rows),
                                .time_s = places.time_s(rows),
                                .component = places.component(rows)};
    const BlockCounts counts = choose_block_counts(own, residual(rows));
    result.counts = {.along_s = std::min(result.counts.along_s, counts.along_s),
                     .along_t = std::min(result.counts.along_t, counts.along_t),
                     .in_time = std::min(result.counts.in_time, counts.in_time)};
  }
  result.blocks = space_time_blocks(places, result.counts);
  return result;
}

}  // namespace clothfit
