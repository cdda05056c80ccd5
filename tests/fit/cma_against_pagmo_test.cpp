// Compares the search that adapts the covariance of its steps with another implementation, pagmo's
// `cmaes`. Both search the unit cube with one population and one first step. The evaluations that
// they need are compared, because their random numbers differ.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <pagmo/algorithm.hpp>
#include <pagmo/algorithms/cmaes.hpp>
#include <pagmo/population.hpp>
#include <pagmo/problem.hpp>
#include <vector>

#include "fit/search/cma_es.h"

namespace clothfit {
namespace {

constexpr int kParameters = 8;
constexpr int kPopulation = 10;
constexpr double kStep = 0.2;
constexpr double kTarget = 1e-10;
constexpr int kTrials = 21;

using Function = double (*)(const std::vector<double>&);

double sphere(const std::vector<double>& x) {
  double sum = 0;
  for (const double a : x) sum += (a - 0.4) * (a - 0.4);
  return sum;
}

double ellipsoid(const std::vector<double>& x) {
  double sum = 0;
  for (size_t i = 0; i < x.size(); ++i)
    sum += std::pow(1e4, static_cast<double>(i) / static_cast<double>(x.size() - 1)) *
           (x[i] - 0.4) * (x[i] - 0.4);
  return sum;
}

/// Evaluates Rosenbrock's function, -2 to 2 on the unit interval.
double rosenbrock(const std::vector<double>& x) {
  const auto at = [&](size_t i) { return 4 * x[i] - 2; };
  double sum = 0;
  for (size_t i = 0; i + 1 < x.size(); ++i)
    sum += 100 * std::pow(at(i + 1) - at(i) * at(i), 2) + std::pow(1 - at(i), 2);
  return sum;
}

struct OfPagmo {
  Function function = nullptr;
  pagmo::vector_double fitness(const pagmo::vector_double& x) const { return {function(x)}; }
  std::pair<pagmo::vector_double, pagmo::vector_double> get_bounds() const {
    return {pagmo::vector_double(kParameters, 0.0), pagmo::vector_double(kParameters, 1.0)};
  }
};

/// Counts evaluations until a cost is at most kTarget; 0 where none is within 20000.
double evaluations_of_pagmo(Function function, unsigned seed) {
  pagmo::population population{pagmo::problem{OfPagmo{function}}, kPopulation, seed};
  pagmo::algorithm strategy{
      pagmo::cmaes{1, -1, -1, -1, -1, kStep, 0, 0, /*memory=*/true, /*force_bounds=*/true, seed}};
  while (population.get_problem().get_fevals() < 20000) {
    population = strategy.evolve(population);
    if (population.champion_f()[0] <= kTarget)
      return static_cast<double>(population.get_problem().get_fevals());
  }
  return 0;
}

double evaluations_of_ours(Function function, unsigned seed) {
  std::vector<SearchParameter> parameters;
  for (int p = 0; p < kParameters; ++p) parameters.push_back({.name = std::to_string(p)});
  const CmaOptions options{.population = kPopulation,
                           .initial_step = kStep,
                           .restarts = 0,
                           .most_evaluations = 20000,
                           .cost_below = kTarget,
                           .seed = seed};
  const GenerationCost cost = [function](const Eigen::MatrixXd& individuals) {
    Eigen::VectorXd costs(individuals.cols());
    for (Eigen::Index k = 0; k < individuals.cols(); ++k)
      costs[k] = function({individuals.col(k).begin(), individuals.col(k).end()});
    return costs;
  };
  const CmaResult result = search_by_cma(parameters, options, cost, start_cma(parameters, options));
  return result.stop == CmaStop::cost_below ? static_cast<double>(result.state.evaluations) : 0;
}

/// Returns the median over the trials that arrive.
double median(std::vector<double> evaluations) {
  std::erase(evaluations, 0);
  std::ranges::sort(evaluations);
  return evaluations.empty() ? 0 : evaluations[evaluations.size() / 2];
}

TEST(CmaEs, NeedsNoMoreEvaluationsThanPagmos) {
  const struct {
    const char* name;
    Function function;
  } kFunctions[] = {{"sphere", sphere}, {"ellipsoid", ellipsoid}, {"Rosenbrock", rosenbrock}};
  for (const auto& [name, function] : kFunctions) {
    SCOPED_TRACE(name);
    std::vector<double> ours, pagmos;
    for (unsigned seed = 1; seed <= kTrials; ++seed) {
      ours.push_back(evaluations_of_ours(function, seed));
      pagmos.push_back(evaluations_of_pagmo(function, seed));
    }
    const auto arrived = [](const std::vector<double>& trials) {
      return kTrials - std::ranges::count(trials, 0.0);
    };
    RecordProperty(std::string(name) + "_ours", std::to_string(median(ours)));
    RecordProperty(std::string(name) + "_pagmo", std::to_string(median(pagmos)));

    // The median of 21 trials is known to some percent.
    EXPECT_GE(arrived(ours), arrived(pagmos) - 3);
    EXPECT_LE(median(ours), 1.1 * median(pagmos));
    EXPECT_GE(median(ours), 0.5 * median(pagmos));
  }
}

}  // namespace
}  // namespace clothfit
