#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "data/model_description.h"
#include "data/progress.h"
#include "fit/problem/problem.h"
#include "model/cloth/cloth.h"
#include "model/fabric/fabric.h"
#include "model/integrate/simulate.h"

namespace clothfit {

/// One run of the model, made ready.
struct Simulation {
  Cloth cloth;
  std::optional<Fabric> fabric;  ///< source of the springs, unless they have their own numbers
  ParameterSet parameters;       ///< starts from the placed sheet, or in motion
  StartKind start = StartKind::released_flat;
  std::vector<double> frame_time_s;
  std::vector<std::string> assumed;  ///< numbers that the model does not give, each in a sentence
};

/// Returns a fabric's numbers by the names of their parameters.
std::map<std::string, double> named(const Fabric& fabric);

/// Returns springs as a model file has them.
ModelSprings springs_of(const SpringParameters& springs);

/// Makes a model ready to run. A contact without a stiffness would touch nothing: it gets one into
/// which the cloth sinks by a tenth of a millimetre under its own weight, and a third of the
/// damping that lets it not bounce. Throws InputError for an unknown effect or parameter of an
/// effect, for contact_mesh without an obstacle, and for more than kMostHeldPoints.
Simulation make_simulation(const ModelDescription& model);

/// Describes a fitted, or given, model of a recording as a model file has it. This is the cloth on
/// the problem's mesh with the parameters `values`, gravity and sheet as they were fitted along,
/// its obstacle, and the found state of a start in motion. Held points have their paths, tracked
/// ones as their smoothing splines at the frames.
ModelDescription describe_model(const FitProblem& problem, const Recording& recording,
                                const Eigen::VectorXd& values);

/// Returns the largest time step that a run takes unless it is told another one. It is two thirds
/// of the largest stable one, as in fits (kStabilityMargin), because the estimate does not see
/// violently crumpled cloth.
double default_time_step_s(const Simulation& simulation);

/// Returns the parameters with which a run begins: a start at rest is relaxed.
ParameterSet started(const Simulation& simulation, double time_step_s, const StopCheck& stop = {});

/// Returns positions of the mesh in every frame. A start at rest is relaxed first. `stop` is asked
/// within both; a run that it ends is not usable.
SimulateResult run(const Simulation& simulation, double time_step_s,
                   const ProgressCallback& progress = {}, const StopCheck& stop = {});

}  // namespace clothfit
