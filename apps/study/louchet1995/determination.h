#pragma once

#include <Eigen/Core>
#include <vector>

#include "apps/study/louchet1995/paper_problem.h"

namespace clothfit {

/// Relative standard deviation of each parameter at the truth, from the Jacobian of residuals that
/// count in their own sigmas; infinite where no residual tells the parameter (or a sum that holds
/// it) from others.
Eigen::VectorXd relative_sigmas(const Objective& whitened, const Eigen::VectorXd& truth);

/// The same of positions measured in every frame of the motion: all vertices, frames of
/// `frame_rate_hz`, independent noise of `noise_m` in each coordinate (Fisher information).
Eigen::VectorXd measured_sigmas(const PaperExperiment& experiment, const RecordedStates& states,
                                SpringSet set, double frame_rate_hz, double noise_m);

/// The same of one predicted transition (state n from state n - 1), whose states are measured with
/// `noise_m` in positions and in dt times velocities.
Eigen::VectorXd transition_sigmas(const PaperExperiment& experiment, const RecordedStates& states,
                                  SpringSet set, int transition, double noise_m);

/// Springs whose length is the limit in a state, as a share of all.
double share_at_limit(const PaperExperiment& experiment, const RecordedStates& states, int state);

}  // namespace clothfit
