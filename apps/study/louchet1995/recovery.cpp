#include "apps/study/louchet1995/recovery.h"

#include <algorithm>
#include <memory>

#include "fit/jobs/draws.h"
#include "fit/refine/refine.h"

namespace clothfit {
namespace {

/// Refinement sees micrometres, so that its own smallest costs lie below rounding.
constexpr double kRefinementUnit_m = 1e-6;
constexpr double kRounding_m = 1e-15;

EvolutionOptions strategy_options(const RecoveryOptions& options, int search) {
  return {.generations = options.generations,
          .least_gain = 0,
          .seed = search == 0 ? options.seed : derived_seed(options.seed, search)};
}

}  // namespace

double rounding_cost(const Objective& objective) {
  return objective.residual_count() * kRounding_m * kRounding_m;
}

Recovery recover(const FitProblem& problem, const RecordedStates& states,
                 const std::vector<int>& transitions, double time_step_s,
                 const RecoveryOptions& options) {
  const StateObjective objective(problem, states, transitions, time_step_s);
  const std::vector<SearchParameter> ranges = search_ranges(problem);
  const GenerationCost cost = sum_of_squares(objective);
  const auto in_small_units = [&](const TimeSteps&) {
    return std::make_unique<StateObjective>(problem, states, transitions, time_step_s,
                                            kRefinementUnit_m);
  };
  const RefineOptions refinement{.iterations = options.iterations,
                                 .rounds = 1,
                                 .least_gain = 1e-16,
                                 .least_step = 1e-12,
                                 .loss = Loss::squared};
  Recovery recovery;
  while (recovery.searches < options.searches && !recovery.exact) {
    const EvolutionOptions strategy = strategy_options(options, recovery.searches);
    const EvolutionResult found =
        evolve(ranges, strategy, cost, {}, {}, [&](const EvolutionState& state) {
          if (recovery.searches > 0 || state.generations() != kListedGeneration) return;
          const auto listed = std::min<std::ptrdiff_t>(10, std::ssize(state.population));
          recovery.listed.assign(state.population.begin(), state.population.begin() + listed);
        });
    if (recovery.searches++ == 0) recovery.strategy = recovery.refined = found.best();
    const int apart = std::max(1, strategy.kept_count() / std::max(1, options.starts));
    for (int start = 0; start < options.starts && !recovery.exact; ++start) {
      const Individual& individual = found.state.population[static_cast<size_t>(start * apart)];
      const RefineResult result =
          refine(problem, in_small_units, individual.values, refinement, {});
      ++recovery.refinements;
      recovery.iterations += result.solver_iterations;
      if (!result.usable) continue;
      const Eigen::VectorXd residual = objective.residuals({result.values}).front();
      if (residual.size() == 0 || residual.squaredNorm() >= recovery.refined.cost) continue;
      recovery.refined.values = result.values;
      recovery.refined.cost = residual.squaredNorm();
      recovery.exact = recovery.refined.cost <= rounding_cost(objective);
    }
  }
  return recovery;
}

double largest_relative_error(const Eigen::VectorXd& values, const Eigen::VectorXd& truth) {
  return ((values - truth).array() / truth.array()).abs().maxCoeff();
}

}  // namespace clothfit
