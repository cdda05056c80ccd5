#pragma once

#include <Eigen/Core>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "data/progress.h"
#include "fit/search/search_parameter.h"

namespace clothfit {

/// The evolutionary strategy of the founding paper [louchet1995, section 3.3], to the letter. Ranks
/// by cost guide selection, never the values. Each generation is ranked, and the next one consists
/// of
///
///   50 %  the best, kept unchanged; their cost is known and not evaluated again;
///   20 %  new by mutation: a parent among the 80 % best of the preceding generation, one of its
///         parameters changed;
///   30 %  new by uniform crossover: as many parents as there are parameters, among the 50 % best
///         of the preceding generation.
///
/// Our choices where the paper leaves things open:
/// - Parents are drawn uniformly and independently (one can be drawn twice).
/// - The mutated parameter is drawn uniformly and redrawn over its whole range (`MutationLaw`).
/// - A crossed individual takes each parameter from a uniformly drawn one of its parents.
/// - Equal costs rank older individuals first.
/// - The first generation is uniform over the ranges.
///
/// The stopping rules beyond the number of generations follow the paper's own conclusion that its
/// runs should have been stopped on the cost.

enum class MutationLaw {
  redraw,   ///< uniform over the parameter's range
  gaussian  ///< normal step of `mutation_step` times the range, reflected at its ends
};

struct EvolutionOptions {
  int population = 100;           ///< >= 2; the paper's 100
  int generations = 100;          ///< >= 1, the random first one included; the paper saw 50 to 100
  double kept = 0.5;              ///< share of the population kept; at least one is
  double mutated = 0.2;           ///< share replaced by mutation; crossover gives the rest
  double mutation_parents = 0.8;  ///< share of the best that may be mutated
  MutationLaw mutation = MutationLaw::redraw;
  double mutation_step = 0.1;  ///< share of the range (or of its logarithm); `gaussian` only
  /// The search stops once the best cost is at or below this.
  double cost_below = -std::numeric_limits<double>::infinity();
  /// The search stops when the best cost fell too little over the last `gain_window` generations:
  /// by less than the share `least_gain` of itself. 0 never stops. A longer window costs
  /// generations after convergence, a shorter one mistakes a pause for the end.
  int gain_window = 20;
  double least_gain = 1e-3;
  /// The search stops after the generation that reaches this many costs, whatever it has found.
  double most_evaluations = std::numeric_limits<double>::infinity();
  unsigned long long seed = 1;

  int kept_count() const;
  int mutated_count() const;
  int crossed_count() const { return population - kept_count() - mutated_count(); }
  int mutation_parent_count() const;
  bool valid() const;  ///< what a search asks of them
};

/// The origin of an individual in its generation.
enum class Origin { random, given, kept, mutated, crossed };

struct Individual {
  Eigen::VectorXd values;  ///< one per parameter, in the parameter's unit
  double cost = std::numeric_limits<double>::infinity();  ///< +infinity when it was not finite
  Origin origin = Origin::random;
  /// Ranks in the preceding generation. They are its own when kept, its parent's when mutated, and
  /// those of all parents drawn (as many as parameters) when crossed. Empty in the first
  /// generation.
  std::vector<int> parent_ranks;
};

/// The whole state of the search between two generations: plain data, to be saved, resumed,
/// compared. The randomness of a new individual depends on (seed, generation, place in it) alone. A
/// resumed search therefore goes on as if it had never stopped.
struct EvolutionState {
  std::vector<Individual> population;  ///< by rank, best first; empty before the first generation
  std::vector<double> best_cost;       ///< after each generation
  long evaluations = 0;                ///< costs asked for
  int generations() const { return static_cast<int>(best_cost.size()); }
};

/// Returns how far the individuals still differ. It is the standard deviation over the population
/// of a parameter's place in its range, as a share of the range, averaged over the parameters. 0.29
/// for a uniform draw, 0 for copies of one individual.
double diversity(const std::vector<SearchParameter>& parameters, const EvolutionState& state);

/// Makes the random first generation. The first individuals are `given` ones, moved into the ranges
/// where they lie outside; at most as many as the population.
EvolutionState first_generation(const std::vector<SearchParameter>& parameters,
                                const EvolutionOptions& options, const GenerationCost& cost,
                                const std::vector<Eigen::VectorXd>& given = {});

/// Makes the generation after `state`.
EvolutionState next_generation(const std::vector<SearchParameter>& parameters,
                               const EvolutionOptions& options, const GenerationCost& cost,
                               const EvolutionState& state);

enum class EvolutionStop {
  not_run,
  reached_generations,
  cost_below,  ///< the best cost is as low as asked
  no_gain,     ///< the best cost hardly falls any more
  out_of_work,
  cancelled
};

struct EvolutionResult {
  EvolutionStop stop = EvolutionStop::not_run;
  std::string message;   ///< one line for a person
  EvolutionState state;  ///< the last generation, ranked; resume from here
  bool usable() const;   ///< at least one finite cost
  const Individual& best() const { return state.population.front(); }
};

/// Receives the state after a generation, for example to save it.
using EvolutionWatcher = std::function<void(const EvolutionState&)>;

/// Makes generations until a stopping rule holds. After each generation `after_generation`, when
/// given, receives the state, then `progress`, when given, is told. Throws InputError for ranges
/// that make no sense.
EvolutionResult evolve(const std::vector<SearchParameter>& parameters,
                       const EvolutionOptions& options, const GenerationCost& cost,
                       const ProgressCallback& progress = {},
                       const std::vector<Eigen::VectorXd>& given = {},
                       const EvolutionWatcher& after_generation = {});

/// Goes on from a saved state, to the same end as a search that was not interrupted.
EvolutionResult resume_evolution(const std::vector<SearchParameter>& parameters,
                                 const EvolutionOptions& options, const GenerationCost& cost,
                                 EvolutionState state, const ProgressCallback& progress = {},
                                 const EvolutionWatcher& after_generation = {});

}  // namespace clothfit
