#pragma once

#include <vector>

#include "model/cloth/cloth.h"

namespace clothfit {

/// Returns the largest time step at which the Euler scheme is stable for this cloth and parameters.
///
/// With gamma the damping rate and omega the frequency of the stiffest mode, the scheme
/// V += h (-omega^2 P - gamma V), P += h V is stable while 2 h gamma + h^2 omega^2 < 4 (both roots
/// of z^2 - (2 - h gamma - h^2 omega^2) z + 1 - h gamma not outside the unit circle). omega^2 and
/// gamma are bounded by `network_bound`, with what effects add. Cloth without any damping whose
/// springs are violently crumpled (to half or twice their length) can still gain energy slowly
/// close to this step; half of it is safe there too.
double stable_time_step_s(const Cloth& cloth, const ParameterSet& parameters);

}  // namespace clothfit
