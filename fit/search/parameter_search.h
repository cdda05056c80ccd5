#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "data/progress.h"
#include "fit/cost/objective.h"
#include "fit/interface/fit_options.h"
#include "fit/problem/problem.h"

namespace clothfit {

/// A place where a search ended.
struct SearchOptimum {
  Eigen::VectorXd values;  ///< all parameters of the problem's space
  double cost = 0;         ///< Objective::mean_length there
  int runs = 1;            ///< runs of the search that ended near it
};

struct SearchedParameters {
  std::vector<SearchOptimum> optima;  ///< distinct, best first; empty where nothing was usable
  std::vector<double> best_cost;      ///< after each generation
  long simulations = 0;
  std::string message;  ///< one line for a person
};

/// Optima nearer to each other than this in every coordinate are one. A population near its end
/// holds many copies of one individual.
inline constexpr double kDifferentOptima = 0.2;

/// Searches the physical parameters of the objective's problem for low Objective::mean_length, the
/// others at `start`. One method is the founding paper's strategy
/// (fit/search/evolutionary_strategy.h). Its optima are the individuals of the last generation that
/// differ, at most `options.refine_best` of them. The other is CMA-ES (fit/search/cma_es.h). Its
/// optima are those in which its runs ended, with as many simulations in all as the paper's
/// strategy would take.
///
/// The state is saved to `options.checkpoint` after each generation, where that names a file. With
/// `options.resume` the search begins from that state, and the result is the same to the last bit.
/// Throws InputError for a checkpoint of another search, recording or model. A search ends early at
/// kMostSpringStepsOfSearch (fit/problem/work_limits.h), as its message says.
SearchedParameters search_parameters(const Objective& objective, const FitOptions& options,
                                     const Eigen::VectorXd& start,
                                     const ProgressCallback& progress);

/// Returns how many simulations a search may take, about.
long search_simulations(const FitOptions& options);

}  // namespace clothfit
