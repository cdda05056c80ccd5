#pragma once

#include <Eigen/Core>
#include <vector>

#include "apps/study/louchet1995/paper_problem.h"

namespace clothfit {

/// Returns the relative standard deviation of each parameter at the truth. It follows from the
/// Jacobian of residuals that count in their own sigmas. It is infinite where no residual tells the
/// parameter (or a sum that holds it) from others.
Eigen::VectorXd relative_sigmas(const Objective& whitened, const Eigen::VectorXd& truth);

/// Returns those from positions measured in every frame of the motion. All vertices are measured,
/// in frames of `frame_rate_hz`, with independent noise of `noise_m` in each coordinate (Fisher
/// information).
Eigen::VectorXd measured_sigmas(const PaperExperiment& experiment, const RecordedStates& states,
                                SpringSet set, double frame_rate_hz, double noise_m);

/// Returns those from one predicted transition (state n from state n - 1). Its states are measured
/// with `noise_m` in positions and in dt times velocities.
Eigen::VectorXd transition_sigmas(const PaperExperiment& experiment, const RecordedStates& states,
                                  SpringSet set, int transition, double noise_m);

/// Returns the share of springs whose length is the limit in a state.
double share_at_limit(const PaperExperiment& experiment, const RecordedStates& states, int state);

}  // namespace clothfit
