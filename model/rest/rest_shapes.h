#pragma once

#include <span>
#include <vector>

#include "model/cloth/cloth.h"

namespace clothfit {

/// The shape in which the cloth hangs still, of every parameter set, held points where `motion` has
/// them at `time_s`: the equilibrium below each set's start positions, to 1e-9 of the weight, so
/// that it is as smooth in the parameters as the physics is. (Where a fold snaps over, it is not.)
/// Cloth that can turn about the vertical without effort, because it hangs from a single point, is
/// turned to where it lies closest to its start.
///
/// As relax() of model/integrate/relax.h, but without effects, among which is the wind, and without
/// the strain limit. A set whose equilibrium is not found gives the shape that was reached. A
/// result does not depend on the other sets, their order or the number of threads.
std::vector<Eigen::Matrix3Xd> rest_shapes(const Cloth& cloth,
                                          std::span<const ParameterSet> parameters, double time_s);

}  // namespace clothfit
