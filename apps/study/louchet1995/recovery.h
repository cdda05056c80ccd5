#pragma once

#include <vector>

#include "apps/study/louchet1995/paper_problem.h"
#include "fit/search/evolutionary_strategy.h"

namespace clothfit {

/// The paper's search, with the refinement that its section 3.3 advises after it: "refine the
/// results using a convex optimisation algorithm". The strategy's best individuals start
/// Levenberg-Marquardt on the same transitions, with exact derivatives, until one ends in a cost
/// that is only rounding. Where none does, the strategy begins again with another seed.
struct RecoveryOptions {
  int generations = 100;  ///< for the strategy
  int starts = 5;         ///< individuals refined, at equal distances over the half that is kept
  int iterations = 400;   ///< for one refinement
  int searches = 6;       ///< strategies at most
  unsigned long long seed = 1;
};

/// The paper prints the population after so many generations.
inline constexpr int kListedGeneration = 49;

struct Recovery {
  std::vector<Individual> listed;  ///< the first strategy's ten best after kListedGeneration
  Individual strategy;             ///< its best at the end
  Individual refined;              ///< the best of all
  bool exact = false;              ///< refined.cost is rounding
  int searches = 0;
  int refinements = 0;
  int iterations = 0;  ///< in all refinements
};

/// Returns a cost, in m^2, that is rounding: 1e-15 m in every number.
double rounding_cost(const Objective& objective);

/// Searches and refines. `states` must be the problem's. Costs are sums of squares in m^2.
Recovery recover(const FitProblem& problem, const RecordedStates& states,
                 const std::vector<int>& transitions, double time_step_s,
                 const RecoveryOptions& options);

/// Returns the largest share by which a value differs from the truth's.
double largest_relative_error(const Eigen::VectorXd& values, const Eigen::VectorXd& truth);

}  // namespace clothfit
