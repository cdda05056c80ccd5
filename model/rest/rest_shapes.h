#pragma once

#include <span>
#include <vector>

#include "model/cloth/cloth.h"

namespace clothfit {

/// Finds, for every parameter set, the shape in which the cloth hangs still. Held points are where
/// `motion` has them at `time_s`. The shape is the equilibrium below each set's start positions, to
/// 1e-9 of the weight, so it is as smooth in the parameters as the physics. (Where a fold snaps
/// over, it is not.) Cloth that hangs from a single point can turn about the vertical without
/// effort; it is turned to where it lies closest to its start.
///
/// The result is as that of relax() of model/integrate/relax.h, but without effects, the wind among
/// them, and without the strain limit. A set whose equilibrium is not found gives the shape that
/// was reached. A result does not depend on the other sets, their order or the number of threads.
std::vector<Eigen::Matrix3Xd> rest_shapes(const Cloth& cloth,
                                          std::span<const ParameterSet> parameters, double time_s);

}  // namespace clothfit
