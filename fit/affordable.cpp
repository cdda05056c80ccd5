#include "fit/affordable.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "data/input_error.h"
#include "fit/problem/memory_limits.h"
#include "fit/problem/parameterised_model.h"
#include "fit/problem/unknown_group.h"
#include "fit/problem/work_limits.h"
#include "fit/refine/refine.h"

namespace clothfit {
namespace {

constexpr const char* kRemedy =
    "a coarser mesh (FitOptions::mesh_columns), a shorter recording, or larger steps "
    "(FitOptions::substep_scale)";

/// Returns the work of a run over the first frames where the parameters begin.
RunWork work_of_frames(const FitProblem& problem, const FitOptions& options, int frames) {
  const RefineOptions defaults;
  const ParameterSet set = parameter_set(problem, problem.space.start());
  const TimeSteps steps = stable_time_steps(problem.cloth, set)
                              .times(1 / (defaults.stability_margin * options.substep_scale));
  const std::vector<double> time_s(problem.frame_time_s.begin(),
                                   problem.frame_time_s.begin() + frames);
  return work_of_run(problem.cloth, time_s, steps, problem.start == StartKind::at_rest,
                     problem.gravity_m_per_s2.norm());
}

double bytes_of_positions(double frames, const Mesh& mesh) {
  return 3 * sizeof(double) * frames * static_cast<double>(mesh.vertex_count());
}

}  // namespace

FitCost least_cost(const FitProblem& problem, const FitOptions& options) {
  constexpr double kStages = 6;            // of the refinement, with the derivatives at its end
  constexpr double kDirectionsPerRun = 1;  // a direction costs about what a run does
  constexpr double kSearchCoarsening = 4;  // vertices of the search's mesh
  const auto directions = static_cast<double>(problem.space.size());
  const double run = work_of_frames(problem, options, problem.first_held_out).spring_steps();
  const double population = options.start || options.forecast ? 0 : options.population;
  const double searched = population * options.search_share;
  FitCost cost;
  cost.spring_steps = run * (kStages * (1 + kDirectionsPerRun * directions) +
                             searched / (kSearchCoarsening * kSearchCoarsening));
  // Positions and their derivatives of every frame, twice while groups of directions are joined;
  // beside them the derivatives of all observations.
  const double of_run = bytes_of_positions(problem.first_held_out, problem.cloth.mesh);
  double numbers = 0;
  for (const ObservationSet& set : problem.observations)
    numbers += static_cast<double>(set.rows.size()) * set.dimension;
  cost.bytes = std::max({of_run * (1 + directions) + 3 * sizeof(double) * numbers * directions,
                         of_run * searched / kSearchCoarsening,
                         bytes_of_positions(problem.frames(), problem.cloth.mesh)});
  return cost;
}

void require_affordable(const FitInput& input, const FitProblem& problem,
                        const FitOptions& options) {
  const std::string where =
      options.forecast ? "FitOptions::forecast" : recording_file(input.recording);
  require_affordable_run(work_of_frames(problem, options, problem.frames()), where, kRemedy);
  const FitCost least = least_cost(problem, options);
  const Mesh& mesh = problem.cloth.mesh;
  require_memory(least.bytes, where,
                 fmt::format("a fit on {} x {} nodes over {} frames", mesh.columns, mesh.rows,
                             problem.first_held_out),
                 kRemedy);
  if (!options.forecast && !(least.spring_steps <= kMostSpringStepsOfFit))
    throw InputError(
        where,
        fmt::format("a fit on {} x {} nodes over {} frames would take {:.2g} spring-steps or more",
                    mesh.columns, mesh.rows, problem.first_held_out, least.spring_steps),
        fmt::format("at most {:.0e}, about a day of a desktop", kMostSpringStepsOfFit), kRemedy);
}

}  // namespace clothfit
