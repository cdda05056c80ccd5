#pragma once

#include <vector>

#include "fit/problem/problem.h"
#include "model/fabric/fabric.h"
#include "model/integrate/relax.h"
#include "model/integrate/simulate.h"
#include "model/integrate/tangent_step.h"

namespace clothfit {

/// Returns the fabric for values of the parameters, where their spring set is `fabric`.
Fabric fabric_of(const FitProblem& problem, const Eigen::VectorXd& values);

/// Returns the model's numbers for values of the parameters. The start shape is the placed sheet.
ParameterSet parameter_set(const FitProblem& problem, const Eigen::VectorXd& values);

/// Returns the derivatives of parameter_set() along each coordinate of the space
/// (fit/problem/parameter_space.h).
std::vector<Direction> directions(const FitProblem& problem, const Eigen::VectorXd& values);

/// Says whether a run and the relaxation of a start at rest are stable at these steps.
bool is_stable(const FitProblem& problem, const ParameterSet& set, const TimeSteps& steps);

/// Runs the model through frames [0, frames) for each parameter vector. A start at rest is relaxed
/// first. A run is not usable where it diverged or the time steps would not be stable.
std::vector<SimulateResult> run_model(const FitProblem& problem,
                                      const std::vector<Eigen::VectorXd>& values, int frames,
                                      const TimeSteps& steps, bool velocities = false);

}  // namespace clothfit
