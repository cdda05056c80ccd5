#pragma once

#include "fit/cost/objective.h"
#include "fit/uncertainty/space_time_blocks.h"

namespace clothfit {

/// Blocks of a trajectory cost's residuals between which they count as independent.
struct ObservedBlocks {
  BlockCounts counts;      ///< into which cloth and time are cut
  SpaceTimeBlocks blocks;  ///< of each residual; fewer than two: they tell of no scatter
};

/// Cuts blocks as the residuals ask for (choose_block_counts), each kind of observation for itself.
/// Of several kinds the coarsest cut counts, for all observe one cloth. Markers lie at their places
/// on the cloth, s and t; frames at their times.
ObservedBlocks observed_blocks(const TrajectoryObjective& objective,
                               const Eigen::VectorXd& residual);

}  // namespace clothfit
