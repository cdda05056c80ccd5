#include "fit/refine/lead_in.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>

#include "data/input_error.h"
#include "fit/cost/track_states.h"
#include "fit/refine/refine.h"
#include "fit/refine/shooting_fit.h"

namespace clothfit {
namespace {

constexpr double kMostSpringSteps = 1e10;  ///< as a stage of the refinement

LeadIn by_shooting(const FitProblem& problem, const FitOptions& options,
                   const Eigen::VectorXd& start, const ProgressCallback& progress) {
  const Mesh& mesh = problem.cloth.mesh;
  ShootingOptions shooting{.most_spring_steps = options.work * kMostSpringSteps,
                           .loss = options.loss};
  shooting.nodes = std::min({shooting.nodes, mesh.columns, mesh.rows});
  const ShootingFit fit =
      fit_by_shooting(problem, problem.first_held_out, start, shooting, progress);
  return {.usable = fit.usable,
          .values = fit.values,
          .stage = fmt::format("shooting on {} x {} over {} frames in {} windows: {} iterations, "
                               "{:.0f} simulations, time step {:.3g} s; {}",
                               mesh.columns, mesh.rows, problem.first_held_out, fit.windows.count(),
                               fit.iterations, fit.runs, fit.time_step_s, fit.message)};
}

LeadIn by_states(const FitProblem& problem, const FitOptions& options, const Eigen::VectorXd& start,
                 const ProgressCallback& progress) {
  if (problem.observations.front().camera)
    throw InputError(
        "FitOptions::cost = " + to_string(options.cost), "the recording is observed in pixels",
        "3D tracks: the cost predicts positions and velocities in space",
        "use FitOptions::cost = shooting, whose windows find their states from pixels");
  const TrackStates tracks = recorded_states_of_tracks(problem);
  const RefineResult result = refine(
      problem,
      [&](const TimeSteps& steps) {
        return state_objective_of_tracks(problem, tracks, options.cost == LeadingCost::full, steps);
      },
      start,
      {.rounds = 3,
       .least_gain = 1e-4,
       .loss = options.loss,
       .most_spring_steps = options.work * kMostSpringSteps},
      progress);
  return {.usable = result.usable,
          .values = result.values,
          .stage = fmt::format("{} cost over {} states from smoothed tracks ({} frames left out, "
                               "sigma {:.2g} mm): {} iterations, time step {:.3g} s; {}",
                               to_string(options.cost), tracks.frame.size(), tracks.left_out,
                               1e3 * tracks.position_sigma_m, result.solver_iterations,
                               result.time_step_s, result.message)};
}

}  // namespace

LeadIn lead_in(const FitProblem& problem, const FitProblem& coarse_problem,
               const FitOptions& options, const Eigen::VectorXd& start,
               const ProgressCallback& progress) {
  assert(options.cost != LeadingCost::trajectory);
  if (options.cost == LeadingCost::shooting)
    return by_shooting(coarse_problem, options, start, progress);
  return by_states(problem, options, start, progress);
}

}  // namespace clothfit
