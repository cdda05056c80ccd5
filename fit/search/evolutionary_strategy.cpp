#include "fit/search/evolutionary_strategy.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <optional>
#include <sstream>
#include <utility>

#include "fit/jobs/draws.h"

namespace clothfit {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Writes six significant digits, whatever the size.
std::string number(double value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

Individual random_individual(const std::vector<SearchParameter>& parameters, Draws& draws) {
  Individual individual;
  individual.values.resize(static_cast<Eigen::Index>(parameters.size()));
  for (size_t p = 0; p < parameters.size(); ++p)
    individual.values(static_cast<Eigen::Index>(p)) = parameters[p].value_at(draws.uniform());
  return individual;
}

Individual given_individual(const std::vector<SearchParameter>& parameters,
                            const Eigen::VectorXd& values) {
  assert(values.size() == static_cast<Eigen::Index>(parameters.size()));
  Individual individual;
  individual.values = values;
  individual.origin = Origin::given;
  for (size_t p = 0; p < parameters.size(); ++p) {
    double& value = individual.values(static_cast<Eigen::Index>(p));
    value = std::clamp(value, parameters[p].lower, parameters[p].upper);
  }
  return individual;
}

Individual mutated_individual(const std::vector<SearchParameter>& parameters,
                              const EvolutionOptions& options,
                              const std::vector<Individual>& ranked, Draws& draws) {
  const int rank = draws.index(options.mutation_parent_count());
  const int chosen = draws.index(static_cast<int>(parameters.size()));
  const SearchParameter& parameter = parameters[static_cast<size_t>(chosen)];

  Individual individual;
  individual.values = ranked[static_cast<size_t>(rank)].values;
  individual.origin = Origin::mutated;
  individual.parent_ranks = {rank};
  double& value = individual.values(chosen);
  switch (options.mutation) {
    case MutationLaw::redraw:
      value = parameter.value_at(draws.uniform());
      break;
    case MutationLaw::gaussian:
      value = parameter.value_at(
          reflected(parameter.fraction(value) + options.mutation_step * draws.normal()));
      break;
  }
  return individual;
}

Individual crossed_individual(int parameter_count, const EvolutionOptions& options,
                              const std::vector<Individual>& ranked, Draws& draws) {
  Individual individual;
  individual.origin = Origin::crossed;
  for (int k = 0; k < parameter_count; ++k)
    individual.parent_ranks.push_back(draws.index(options.kept_count()));
  individual.values.resize(parameter_count);
  for (int p = 0; p < parameter_count; ++p) {
    const int parent = individual.parent_ranks[static_cast<size_t>(draws.index(parameter_count))];
    individual.values(p) = ranked[static_cast<size_t>(parent)].values(p);
  }
  return individual;
}

/// Computes the costs of the individuals from `first_new` on, ranks all and notes the best.
void evaluate_and_rank(const GenerationCost& cost, size_t first_new, EvolutionState& state) {
  const size_t count = state.population.size() - first_new;
  if (count > 0) {
    Eigen::MatrixXd individuals(state.population.front().values.size(),
                                static_cast<Eigen::Index>(count));
    for (size_t k = 0; k < count; ++k)
      individuals.col(static_cast<Eigen::Index>(k)) = state.population[first_new + k].values;
    const Eigen::VectorXd costs = cost(individuals);
    assert(costs.size() == individuals.cols());
    for (size_t k = 0; k < count; ++k) {
      const double value = costs(static_cast<Eigen::Index>(k));
      state.population[first_new + k].cost = std::isfinite(value) ? value : kInfinity;
    }
    state.evaluations += static_cast<long>(count);
  }
  std::stable_sort(state.population.begin(), state.population.end(),
                   [](const Individual& a, const Individual& b) { return a.cost < b.cost; });
  state.best_cost.push_back(state.population.front().cost);
}

/// Returns the share of itself by which the best cost fell over the last `window` generations.
double relative_gain(const std::vector<double>& best_cost, int window) {
  const double now = best_cost.back();
  const double before = best_cost[best_cost.size() - 1 - static_cast<size_t>(window)];
  if (!(now < before)) return 0;
  if (!std::isfinite(before) || before == 0) return kInfinity;
  return (before - now) / std::abs(before);
}

std::optional<EvolutionStop> stop_reason(const EvolutionOptions& options,
                                         const EvolutionState& state) {
  if (state.best_cost.back() <= options.cost_below) return EvolutionStop::cost_below;
  if (options.least_gain > 0 && state.generations() > options.gain_window &&
      relative_gain(state.best_cost, options.gain_window) < options.least_gain)
    return EvolutionStop::no_gain;
  if (state.generations() >= options.generations) return EvolutionStop::reached_generations;
  if (static_cast<double>(state.evaluations) >= options.most_evaluations)
    return EvolutionStop::out_of_work;
  return std::nullopt;
}

std::string describe(EvolutionStop stop, const EvolutionOptions& options,
                     const EvolutionState& state) {
  std::string text;
  switch (stop) {
    case EvolutionStop::not_run:
      text = "not run";
      break;
    case EvolutionStop::reached_generations:
      text = "reached the last generation";
      break;
    case EvolutionStop::cost_below:
      text = "the cost is as low as asked";
      break;
    case EvolutionStop::no_gain:
      text = "no gain over " + std::to_string(options.gain_window) + " generations";
      break;
    case EvolutionStop::out_of_work:
      text = "cut short at the limit of work";
      break;
    case EvolutionStop::cancelled:
      text = "cancelled";
      break;
  }
  text += " (" + std::to_string(state.generations()) + " generations, " +
          std::to_string(state.evaluations) + " evaluations)";
  if (!std::isfinite(state.best_cost.back())) text += "; no individual has a finite cost";
  return text;
}

int share_of(int population, double share) {
  return static_cast<int>(std::lround(share * population));
}

}  // namespace

int EvolutionOptions::kept_count() const {
  return std::max(1, share_of(population, kept));
}

int EvolutionOptions::mutated_count() const {
  return std::min(population - kept_count(), share_of(population, mutated));
}

int EvolutionOptions::mutation_parent_count() const {
  return std::max(1, share_of(population, mutation_parents));
}

bool EvolutionOptions::valid() const {
  const auto is_share = [](double share) { return share >= 0 && share <= 1; };
  return population >= 2 && generations >= 1 && is_share(kept) && is_share(mutated) &&
         is_share(mutation_parents) && kept + mutated <= 1 + 1e-12 && kept_count() < population &&
         mutation_step > 0 && std::isfinite(mutation_step) && gain_window >= 1 && least_gain >= 0 &&
         !std::isnan(cost_below);
}

bool EvolutionResult::usable() const {
  return !state.population.empty() && std::isfinite(state.population.front().cost);
}

EvolutionState first_generation(const std::vector<SearchParameter>& parameters,
                                const EvolutionOptions& options, const GenerationCost& cost,
                                const std::vector<Eigen::VectorXd>& given) {
  assert(options.valid());
  require_ranges(parameters);
  assert(static_cast<int>(given.size()) <= options.population);

  EvolutionState state;
  for (const Eigen::VectorXd& values : given)
    state.population.push_back(given_individual(parameters, values));
  for (int place = static_cast<int>(given.size()); place < options.population; ++place) {
    Draws draws(options.seed, 0, place);
    state.population.push_back(random_individual(parameters, draws));
  }
  evaluate_and_rank(cost, 0, state);
  return state;
}

double diversity(const std::vector<SearchParameter>& parameters, const EvolutionState& state) {
  const auto individuals = static_cast<Eigen::Index>(state.population.size());
  double sum = 0;
  for (size_t p = 0; p < parameters.size(); ++p) {
    Eigen::ArrayXd shares(individuals);
    for (Eigen::Index n = 0; n < individuals; ++n) {
      const Individual& individual = state.population[static_cast<size_t>(n)];
      shares[n] = parameters[p].fraction(individual.values(static_cast<Eigen::Index>(p)));
    }
    sum += std::sqrt((shares - shares.mean()).square().mean());
  }
  return sum / static_cast<double>(parameters.size());
}

EvolutionState next_generation(const std::vector<SearchParameter>& parameters,
                               const EvolutionOptions& options, const GenerationCost& cost,
                               const EvolutionState& state) {
  const std::vector<Individual>& ranked = state.population;
  assert(static_cast<int>(ranked.size()) == options.population);

  EvolutionState next;
  next.best_cost = state.best_cost;
  next.evaluations = state.evaluations;
  for (int rank = 0; rank < options.kept_count(); ++rank) {
    Individual individual = ranked[static_cast<size_t>(rank)];
    individual.origin = Origin::kept;
    individual.parent_ranks = {rank};
    next.population.push_back(std::move(individual));
  }
  const int crossed_from = options.kept_count() + options.mutated_count();
  for (int place = options.kept_count(); place < options.population; ++place) {
    Draws draws(options.seed, state.generations(), place);
    next.population.push_back(
        place < crossed_from
            ? mutated_individual(parameters, options, ranked, draws)
            : crossed_individual(static_cast<int>(parameters.size()), options, ranked, draws));
  }
  evaluate_and_rank(cost, static_cast<size_t>(options.kept_count()), next);
  return next;
}

EvolutionResult resume_evolution(const std::vector<SearchParameter>& parameters,
                                 const EvolutionOptions& options, const GenerationCost& cost,
                                 EvolutionState state, const ProgressCallback& progress,
                                 const EvolutionWatcher& after_generation) {
  assert(options.valid());
  require_ranges(parameters);
  assert(!state.population.empty());

  const int new_each = options.population - options.kept_count();
  const auto goes_on = [&] {
    return !progress ||
           progress(
               {.stage = "search",
                .done = static_cast<double>(state.evaluations),
                .total = static_cast<double>(options.population +
                                             static_cast<long>(options.generations - 1) * new_each),
                .unit = "evaluations",
                .note = "best cost " + number(state.best_cost.back()) + ", diversity " +
                        number(diversity(parameters, state))});
  };

  EvolutionResult result;
  while (true) {
    // A rule that already holds says more than the cancellation that came at the same moment.
    const bool cancelled = !goes_on();
    const std::optional<EvolutionStop> stop = stop_reason(options, state);
    if (stop || cancelled) {
      result.stop = stop.value_or(EvolutionStop::cancelled);
      break;
    }
    state = next_generation(parameters, options, cost, state);
    if (after_generation) after_generation(state);
  }
  result.message = describe(result.stop, options, state);
  result.state = std::move(state);
  return result;
}

EvolutionResult evolve(const std::vector<SearchParameter>& parameters,
                       const EvolutionOptions& options, const GenerationCost& cost,
                       const ProgressCallback& progress, const std::vector<Eigen::VectorXd>& given,
                       const EvolutionWatcher& after_generation) {
  EvolutionState state = first_generation(parameters, options, cost, given);
  if (after_generation) after_generation(state);
  return resume_evolution(parameters, options, cost, std::move(state), progress, after_generation);
}

}  // namespace clothfit
