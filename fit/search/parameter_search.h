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
  Eigen::VectorXd values;  ///< of the problem's space
  double cost = 0;         ///< Objective::mean_length there
  int runs = 1;            ///< of the search that ended near it
};

struct SearchedParameters {
  std::vector<SearchOptimum> optima;  ///< that differ, best first; empty where nothing was usable
  std::vector<double> best_cost;      ///< after each generation
  long simulations = 0;
  bool cancelled = false;
  std::string message;  ///< one line for a person
};

/// Optima nearer to each other than this in every coordinate are one: a population near its end
/// holds many copies of one individual.
inline constexpr double kDifferentOptima = 0.2;

/// Searches the physical parameters of the objective's problem for low Objective::mean_length, the
/// others at `start`: by the founding paper's strategy (fit/search/evolutionary_strategy.h), whose
/// optima are the individuals of the last generation that differ, at most `options.refine_best` of
/// them; or by CMA-ES (fit/search/cma_es.h), whose optima are those that its runs ended in, with as
/// many simulations in all as the paper's strategy would take.
///
/// The state is saved to `options.checkpoint` after each generation, where that names a file, and
/// taken from there to begin with where `options.resume` asks so: the result is the same to the
/// last bit. Throws InputError for a checkpoint of another search, recording or model.
SearchedParameters search_parameters(const Objective& objective, const FitOptions& options,
                                     const Eigen::VectorXd& start,
                                     const ProgressCallback& progress);

/// Simulations that a search may take, about.
long search_simulations(const FitOptions& options);

}  // namespace clothfit
