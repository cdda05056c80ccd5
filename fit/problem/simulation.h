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
  std::optional<Fabric> fabric;  ///< that the springs come from, unless they have their own numbers
  ParameterSet parameters;       ///< starts from the placed sheet, or in motion
  StartKind start = StartKind::released_flat;
  std::vector<double> frame_time_s;
};

/// A fabric's numbers by the names of their parameters.
std::map<std::string, double> named(const Fabric& fabric);

/// Springs as a model file has them.
ModelSprings springs_of(const SpringParameters& springs);

/// Throws InputError for an effect, or a parameter of one, that does not exist, and for
/// contact_mesh without an obstacle.
Simulation make_simulation(const ModelDescription& model);

/// A fitted, or given, model of a recording as a model file has it: the cloth on the problem's mesh
/// with the parameters `values`, gravity and the sheet as they were fitted along, and the paths of
/// held points, tracked ones as their smoothing splines have them at the frames; its obstacle; the
/// state that a start in motion was found to be in.
ModelDescription describe_model(const FitProblem& problem, const Recording& recording,
                                const Eigen::VectorXd& values);

/// The largest time step that a run takes unless it is told another one: two thirds of the largest
/// stable one, as fits leave it (kStabilityMargin), because the estimate does not
/// see violently crumpled cloth.
double default_time_step_s(const Simulation& simulation);

/// The parameters as a run goes on from its start: one at rest is relaxed.
ParameterSet started(const Simulation& simulation, double time_step_s);

/// Positions of the mesh in every frame. A start at rest is relaxed first.
SimulateResult run(const Simulation& simulation, double time_step_s,
                   const ProgressCallback& progress = {});

}  // namespace clothfit
