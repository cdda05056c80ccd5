#pragma once

#include "fit/cost/objective.h"

namespace clothfit {

/// Mean distance, in sigmas, of the objective's observations from the first of their marker in
/// their set: what a cloth that stands still would leave, about. 0 for blocks that are no
/// observations.
double observed_motion(const Objective& objective);

/// An Objective::mean_length below which a model follows the cloth: a twentieth of the observed
/// motion. Whatever local refinement needs from a search is there then: the right basin.
double cost_of_following(const Objective& objective);

}  // namespace clothfit
