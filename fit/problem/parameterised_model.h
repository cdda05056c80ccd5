#pragma once

#include <vector>

#include "fit/problem/problem.h"
#include "model/fabric/fabric.h"
#include "model/integrate/relax.h"
#include "model/integrate/simulate.h"
#include "model/integrate/tangent_step.h"

namespace clothfit {

/// The fabric for values of the parameters, whose spring set it is.
Fabric fabric_of(const FitProblem& problem, const Eigen::VectorXd& values);

/// The model's numbers for values of the parameters. The start shape is the placed sheet.
ParameterSet parameter_set(const FitProblem& problem, const Eigen::VectorXd& values);

/// How the model's numbers change along each coordinate of the space
/// (fit/problem/parameter_space.h): the derivatives of what parameter_set() returns.
std::vector<Direction> directions(const FitProblem& problem, const Eigen::VectorXd& values);

/// Whether a run of the model, and the relaxation of a start at rest, are stable at these steps.
bool is_stable(const FitProblem& problem, const ParameterSet& set, const TimeSteps& steps);

/// The model's run through frames [0, frames) for each parameter vector; not usable where it
/// diverged or the time steps would not be stable. A start at rest is relaxed first.
std::vector<SimulateResult> run_model(const FitProblem& problem,
                                      const std::vector<Eigen::VectorXd>& values, int frames,
                                      const TimeSteps& steps, bool velocities = false);

}  // namespace clothfit
