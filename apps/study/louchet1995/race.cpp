#include "apps/study/louchet1995/race.h"

#include <algorithm>

#include "fit/search/cma_es.h"
#include "fit/search/evolutionary_strategy.h"

namespace clothfit {
namespace {

constexpr int kPopulation = 100;
constexpr double kThinning = 1.1;  ///< evaluations from one point of a curve to the next

bool is_cma(Racer racer) {
  return racer == Racer::cma_5 || racer == Racer::cma_18;
}

/// Returns as many individuals for each parameter as the paper has for five.
int population_of(Racer racer) {
  return racer == Racer::strategy_18_large ? kPopulation * 18 / 5 : kPopulation;
}

class Record {
 public:
  explicit Record(double unit) : unit_(unit) {
    race_.generations.fill(-1);
    race_.costs_asked.fill(-1);
  }
  void note(int generations, long evaluations, double best_cost) {
    const double relative = best_cost / unit_;
    for (size_t mark = 0; mark < kRaceMarks.size(); ++mark) {
      if (race_.generations[mark] >= 0 || relative > kRaceMarks[mark]) continue;
      race_.generations[mark] = generations;
      race_.costs_asked[mark] = evaluations;
    }
    if (!race_.evaluations.empty() && static_cast<double>(evaluations) <
                                          kThinning * static_cast<double>(race_.evaluations.back()))
      return;
    race_.evaluations.push_back(evaluations);
    race_.relative_cost.push_back(relative);
  }
  const Race& race() const { return race_; }

 private:
  double unit_;
  Race race_;
};

double median_cost(const EvolutionState& first) {
  return first.population[first.population.size() / 2].cost;
}

}  // namespace

std::string to_string(Racer racer) {
  switch (racer) {
    case Racer::strategy_5:
      return "strategy, 5 parameters";
    case Racer::strategy_18:
      return "strategy, 18 parameters";
    case Racer::strategy_18_large:
      return "strategy, 18 parameters, 360 individuals";
    case Racer::cma_5:
      return "CMA-ES, 5 parameters";
    case Racer::cma_18:
      return "CMA-ES, 18 parameters";
  }
  return "";
}

SpringSet parameters_of(Racer racer) {
  return racer == Racer::strategy_5 || racer == Racer::cma_5 ? SpringSet::louchet5
                                                             : SpringSet::louchet18;
}

long race_length(Racer racer, bool quick) {
  return (quick ? 600L : 12000L) * population_of(racer) / kPopulation;
}

Race race(const PaperExperiment& experiment, const RecordedStates& states, Racer racer,
          unsigned long long seed, bool quick) {
  const FitProblem problem = paper_problem(experiment, states, parameters_of(racer));
  const StateObjective objective(problem, states, small_cost_transitions(states),
                                 experiment.time_step_s);
  const GenerationCost cost = sum_of_squares(objective);
  const std::vector<SearchParameter> ranges = search_ranges(problem);
  const EvolutionOptions sample{.population = kPopulation, .seed = seed};
  const long length = race_length(racer, quick);

  Record record(median_cost(first_generation(ranges, sample, cost)));
  if (is_cma(racer)) {
    const CmaOptions options{.most_evaluations = length, .seed = seed};
    search_by_cma(ranges, options, cost, start_cma(ranges, options), {},
                  [&](const CmaState& state) {
                    record.note(state.generations(), state.evaluations, state.best_cost.back());
                  });
    return record.race();
  }
  EvolutionOptions options{.population = population_of(racer), .least_gain = 0, .seed = seed};
  const long bred = options.population - options.kept_count();
  options.generations = static_cast<int>(1 + (length - options.population) / bred);
  evolve(ranges, options, cost, {}, {}, [&](const EvolutionState& state) {
    record.note(state.generations(), state.evaluations, state.best_cost.back());
  });
  return record.race();
}

}  // namespace clothfit
