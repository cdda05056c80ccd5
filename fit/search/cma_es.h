#pragma once

#include <Eigen/Core>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "data/progress.h"
#include "fit/search/search_parameter.h"

namespace clothfit {

/// Options of CMA-ES, an evolution strategy that adapts the covariance of its steps. It has
/// negative weights for the worse half [hansen2016], and restarts with growing populations from new
/// random means [auger2005]. Only the ranks of costs guide it.
///
/// It works on shares of the ranges (logarithmic where a parameter is) without bounds. Individuals
/// are folded into the ranges as between mirrors, so that an optimum at an end is an inner one of
/// the folded cost.
struct CmaOptions {
  int population = 0;  ///< in the first run; 0: 4 + floor(3 ln n) for n parameters; else >= 4
  double initial_step = 0.3;  ///< standard deviation of the first generation, as a share of ranges
  int restarts = 9;           ///< at most
  double growth = 2;  ///< populations grow by it from restart to restart, up to most_evaluations
  long most_evaluations = 100000;  ///< in all runs; the last generation may exceed it
  /// The search stops once the best cost is at or below this.
  double cost_below = -std::numeric_limits<double>::infinity();
  /// A run ends when the costs of some generations hardly differ: by less than this share of their
  /// largest magnitude, or less than the smallest normal number.
  double cost_tolerance = 1e-12;
  /// A run ends when every standard deviation is below this share of the initial step.
  double step_tolerance = 1e-12;
  unsigned long long seed = 1;

  int first_population(int parameters) const;
  bool valid() const;  ///< what a search asks of them
};

/// Populations of restarts grow to this at most.
inline constexpr int kLargestCmaPopulation = 1'000'000;

/// The reason why one run ended.
enum class CmaEnd {
  costs_equal,      ///< cost_tolerance
  steps_small,      ///< step_tolerance
  ill_conditioned,  ///< the covariance's condition number exceeds 1e14
  too_long,         ///< more generations than such a run should take
  nothing_finite    ///< no cost of a generation was finite
};

/// The optimum in which one run ended.
struct CmaOptimum {
  Eigen::VectorXd values;  ///< the best in the run, one per parameter, in its unit
  double cost = std::numeric_limits<double>::infinity();
  CmaEnd end = CmaEnd::costs_equal;
  long evaluations = 0;  ///< in this run
};

/// The whole state of the search between two generations: plain data, to be saved, resumed,
/// compared. The randomness of an individual depends on (seed, generation, place in it) alone.
struct CmaState {
  int population = 0;
  Eigen::VectorXd mean;        ///< shares of the ranges, unbounded
  double step = 0;             ///< sigma
  Eigen::MatrixXd covariance;  ///< C, n x n
  Eigen::VectorXd covariance_path, step_path;
  int generation = 0;               ///< in this run
  std::vector<double> recent_best;  ///< best cost of this run's last generations
  CmaOptimum so_far;                ///< in this run; `end` without meaning

  std::vector<CmaOptimum> optima;  ///< one for each run that has ended
  std::vector<double> best_cost;   ///< the best in all runs, after each generation
  long evaluations = 0;
  int generations() const { return static_cast<int>(best_cost.size()); }
  const CmaOptimum& best() const;  ///< the best in all runs, the one at hand included
};

/// Returns how far the individuals of a generation differ. It is sigma times the square root of the
/// covariance's mean eigenvalue. That is the root mean square over the parameters of the
/// individuals' standard deviation as a share of the range (before they are folded into it).
double diversity(const CmaState& state);

/// Returns the start, with nothing evaluated. The first mean is `given` (in the parameters' units,
/// moved into the ranges), or the middle of the ranges.
CmaState start_cma(const std::vector<SearchParameter>& parameters, const CmaOptions& options,
                   const Eigen::VectorXd& given = {});

/// Makes one generation more. Where it ends a run, the next begins (with the restarts used up,
/// too).
CmaState next_cma_generation(const std::vector<SearchParameter>& parameters,
                             const CmaOptions& options, const GenerationCost& cost, CmaState state);

enum class CmaStop { not_run, cost_below, most_evaluations, restarts_used, cancelled };

struct CmaResult {
  CmaStop stop = CmaStop::not_run;
  std::string message;  ///< one line for a person
  CmaState state;       ///< resume from here
  bool usable() const;  ///< at least one finite cost
};

/// Receives the state after a generation, for example to save it.
using CmaWatcher = std::function<void(const CmaState&)>;

/// Makes generations until a stopping rule holds. `state` is a start or a saved state, which leads
/// to the same end as a search that was not interrupted. After each generation `after_generation`,
/// when given, receives the state, then `progress`, when given, is told. Throws InputError for
/// ranges that make no sense.
CmaResult search_by_cma(const std::vector<SearchParameter>& parameters, const CmaOptions& options,
                        const GenerationCost& cost, CmaState state,
                        const ProgressCallback& progress = {},
                        const CmaWatcher& after_generation = {});

}  // namespace clothfit
