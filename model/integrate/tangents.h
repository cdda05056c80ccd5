#pragma once

#include <span>
#include <vector>

#include "model/integrate/simulate.h"
#include "model/integrate/tangent_step.h"

namespace clothfit {

struct TangentResult {
  SimulateResult run;
  /// [direction][frame]: derivative of the positions, 3 x vertices; from a diverged frame on NaN.
  std::vector<std::vector<Eigen::Matrix3Xd>> position_tangent;
  /// [direction][frame]: derivative of the velocities, where the schedule asks for them.
  std::vector<std::vector<Eigen::Matrix3Xd>> velocity_tangent;
};

/// Simulates one parameter set together with the derivatives of its positions along every
/// direction. Each step is differentiated forwards: exact for the discrete scheme wherever it is
/// smooth. Directions that share a run share its cost and the linearisation of effects; such groups
/// run in parallel. Bits depend on no other direction, but for Schedule::fast_derivatives, nor on
/// the number of threads; `run` has the bits that simulate() gives. `stop` is asked between steps:
/// what it ends is cancelled, derivatives and all.
TangentResult simulate_with_tangents(const Cloth& cloth, const ParameterSet& parameters,
                                     std::span<const Direction> directions,
                                     const Schedule& schedule, const StopCheck& stop = {});

}  // namespace clothfit
