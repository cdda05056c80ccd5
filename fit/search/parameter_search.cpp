#include "fit/search/parameter_search.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "fit/cost/observed_motion.h"
#include "fit/jobs/checksum.h"
#include "fit/jobs/stop_token.h"
#include "fit/problem/work_limits.h"
#include "fit/search/cma_es.h"
#include "fit/search/evolutionary_strategy.h"
#include "fit/search/search_checkpoint.h"

namespace clothfit {
namespace {

/// The searched parameters, and the places of their values among the problem's.
struct SearchSpace {
  std::vector<SearchParameter> ranges;
  std::vector<int> searched;  ///< index into the problem's space
  Eigen::VectorXd start;

  SearchSpace(const ParameterSpace& space, const Eigen::VectorXd& others) : start(others) {
    for (int p = 0; p < space.size(); ++p) {
      const FitParameter& parameter = space.parameters[static_cast<size_t>(p)];
      if (!is_physical(parameter.role)) continue;
      searched.push_back(p);
      ranges.push_back({.name = parameter.name,
                        .lower = parameter.searched_from(),
                        .upper = parameter.upper,
                        .log_scale = parameter.scale == ParameterScale::logarithmic});
    }
  }
  Eigen::VectorXd all_values(const Eigen::VectorXd& individual) const {
    Eigen::VectorXd values = start;
    for (size_t n = 0; n < searched.size(); ++n)
      values[searched[n]] = individual[static_cast<Eigen::Index>(n)];
    return values;
  }
  Eigen::VectorXd individual(const Eigen::VectorXd& values) const { return values(searched); }
};

std::uint64_t add_bytes(const double* numbers, Eigen::Index count, std::uint64_t before) {
  const auto size = static_cast<size_t>(count) * sizeof(double);
  return checksum(std::string_view(reinterpret_cast<const char*>(numbers), size), before);
}

/// Writes a line that differs wherever costs could. It names the mesh, the window and the time
/// step. It also sums what was observed and the residuals of one run of the model, which any change
/// of cloth, held points, effects or start alters.
std::string problem_line(const Objective& objective, const Eigen::VectorXd& start) {
  std::uint64_t sum = add_bytes(start.data(), start.size(), kEmptyChecksum);
  int last_frame = 0;
  for (const Objective::Block& block : objective.blocks()) {
    if (block.set < 0) continue;
    const Observation& row = objective.problem()
                                 .observations[static_cast<size_t>(block.set)]
                                 .rows[static_cast<size_t>(block.row)];
    last_frame = std::max(last_frame, row.frame);
    sum = add_bytes(row.observed.data(), row.observed.size(), sum);
    sum = add_bytes(&row.sigma, 1, sum);
  }
  const Eigen::VectorXd residual = objective.residuals({start}).front();
  sum = add_bytes(residual.data(), residual.size(), sum);
  const Mesh& mesh = objective.problem().cloth.mesh;
  return fmt::format("fit of {} to {} residuals to frame {} on {}x{} at steps of {} s, sum {:016x}",
                     to_string(objective.problem().spring_set), objective.residual_count(),
                     last_frame, mesh.columns, mesh.rows, objective.time_step_s(), sum);
}

/// Takes the optima, best first, that differ from those before; the others count as runs of these.
class Distinct {
 public:
  Distinct(const ParameterSpace& space, std::vector<SearchOptimum>& optima)
      : space_(space), optima_(optima) {}

  void add(const Eigen::VectorXd& values, double cost) {
    const auto near = std::ranges::find_if(optima_, [&](const SearchOptimum& other) {
      return (space_.coordinates(values) - space_.coordinates(other.values))
                 .cwiseAbs()
                 .maxCoeff() <= kDifferentOptima;
    });
    if (near != optima_.end())
      ++near->runs;
    else
      optima_.push_back({.values = values, .cost = cost});
  }

 private:
  const ParameterSpace& space_;
  std::vector<SearchOptimum>& optima_;
};

SearchedParameters search_by_strategy(const SearchSpace& space, const FitOptions& options,
                                      const std::string& problem, const ParameterSpace& parameters,
                                      const GenerationCost& cost, double stop_cost,
                                      double affordable, const ProgressCallback& progress) {
  const EvolutionOptions evolution{.population = options.population,
                                   .generations = options.generations,
                                   .cost_below = stop_cost,
                                   .gain_window = 15,
                                   .least_gain = 1e-2,
                                   .most_evaluations = affordable,
                                   .seed = options.seed};
  const EvolutionWatcher save = [&](const EvolutionState& state) {
    if (!options.checkpoint.empty())
      save_checkpoint(options.checkpoint, problem, space.ranges, evolution, state);
  };
  const EvolutionResult result =
      options.resume ? resume_evolution(space.ranges, evolution, cost,
                                        load_evolution_checkpoint(options.checkpoint, problem,
                                                                  space.ranges, evolution),
                                        progress, save)
                     : evolve(space.ranges, evolution, cost, progress, {}, save);

  SearchedParameters found;
  found.best_cost = result.state.best_cost;
  found.simulations = result.state.evaluations;
  found.message = fmt::format("evolutionary search: {} generations; {}", result.state.generations(),
                              result.message);
  if (!result.usable()) return found;
  Distinct distinct(parameters, found.optima);
  for (const Individual& individual : result.state.population) {
    if (!std::isfinite(individual.cost)) break;
    distinct.add(space.all_values(individual.values), individual.cost);
    if (static_cast<int>(found.optima.size()) == options.refine_best) break;
  }
  // Copies of one individual are no runs.
  for (SearchOptimum& optimum : found.optima) optimum.runs = 1;
  return found;
}

SearchedParameters search_by_restarts(const SearchSpace& space, const FitOptions& options,
                                      const std::string& problem, const ParameterSpace& parameters,
                                      const GenerationCost& cost, double stop_cost,
                                      double affordable, const ProgressCallback& progress) {
  const auto most = static_cast<double>(search_simulations(options));
  // A generation fills the lanes; a run may end where refinement takes over.
  const CmaOptions cma{.population = 16,
                       .most_evaluations = static_cast<long>(std::min(most, affordable)),
                       .cost_below = stop_cost,
                       .cost_tolerance = 1e-3,
                       .step_tolerance = 1e-2,
                       .seed = options.seed};
  CmaState start = options.resume
                       ? load_cma_checkpoint(options.checkpoint, problem, space.ranges, cma)
                       : start_cma(space.ranges, cma, space.individual(space.start));
  const CmaResult result = search_by_cma(
      space.ranges, cma, cost, std::move(start), progress, [&](const CmaState& state) {
        if (!options.checkpoint.empty())
          save_checkpoint(options.checkpoint, problem, space.ranges, cma, state);
      });

  SearchedParameters found;
  found.best_cost = result.state.best_cost;
  found.simulations = result.state.evaluations;
  found.message =
      fmt::format("CMA-ES: {} generations; {}", result.state.generations(), result.message);
  if (!result.usable()) return found;
  std::vector<CmaOptimum> optima = result.state.optima;
  // A run that was cut short has found no optimum, unless it is the best there is.
  if (&result.state.best() == &result.state.so_far) optima.push_back(result.state.so_far);
  std::erase_if(optima, [](const CmaOptimum& optimum) { return !std::isfinite(optimum.cost); });
  std::ranges::stable_sort(optima, {}, &CmaOptimum::cost);
  Distinct distinct(parameters, found.optima);
  for (const CmaOptimum& optimum : optima)
    distinct.add(space.all_values(optimum.values), optimum.cost);
  return found;
}

}  // namespace

long search_simulations(const FitOptions& options) {
  // Half of a generation is kept, with its costs.
  return std::max(1L, static_cast<long>(options.population) * (options.generations + 1) / 2);
}

SearchedParameters search_parameters(const Objective& objective, const FitOptions& options,
                                     const Eigen::VectorXd& start,
                                     const ProgressCallback& progress) {
  const ParameterSpace& parameters = objective.problem().space;
  const SearchSpace space(parameters, start);
  const GenerationCost cost = [&](const Eigen::MatrixXd& individuals) {
    std::vector<Eigen::VectorXd> values;
    for (Eigen::Index n = 0; n < individuals.cols(); ++n)
      values.push_back(space.all_values(individuals.col(n)));
    const std::vector<Eigen::VectorXd> residuals = objective.residuals(values);
    Eigen::VectorXd costs(individuals.cols());
    for (Eigen::Index n = 0; n < individuals.cols(); ++n)
      costs[n] = objective.mean_length(residuals[static_cast<size_t>(n)]);
    return costs;
  };
  const std::string problem =
      options.checkpoint.empty() ? std::string() : problem_line(objective, start);
  const double stop_cost = options.stop_cost.value_or(cost_of_following(objective));
  const double affordable = kMostSpringStepsOfSearch / objective.spring_steps_per_run();
  const ProgressCallback token = stop_token(progress);
  return options.search == SearchMethod::cma
             ? search_by_restarts(space, options, problem, parameters, cost, stop_cost, affordable,
                                  token)
             : search_by_strategy(space, options, problem, parameters, cost, stop_cost, affordable,
                                  token);
}

}  // namespace clothfit
