#pragma once

#include "fit/cost/objective.h"

namespace clothfit {

/// Returns the mean distance, in sigmas, of the observations from the first of their marker in
/// their set. About as much is the residual of a cloth that stands still. Blocks that are no
/// observations are left out; without others the result is 0.
double observed_motion(const Objective& objective);

/// Returns an Objective::mean_length below which a model follows the cloth. It is a twentieth of
/// the observed motion. Such a model is in the right basin, which is all that local refinement
/// needs from a search.
double cost_of_following(const Objective& objective);

}  // namespace clothfit
