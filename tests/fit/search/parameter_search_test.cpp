// Checks a fit's search over the ranges, on costs whose optima are known. Not checked here: the
// strategies themselves (evolutionary_strategy_test.cpp, cma_es_test.cpp), and the contents of
// checkpoints (search_checkpoint_test.cpp).
#include "fit/search/parameter_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "data/input_error.h"
#include "fit/cost/observed_motion.h"
#include "fit/jobs/stop_token.h"
#include "tests/data/temporary_folder.h"

namespace clothfit {
namespace {

/// Returns a problem with two parameters of the physics and one of the placement, which is not
/// searched. Its marker was seen to move by 20 sigmas.
FitProblem searched_problem() {
  FitProblem problem;
  problem.space.parameters = {
      {.name = "stiffness",
       .role = ParameterRole::springs,
       .scale = ParameterScale::logarithmic,
       .lower = 1,
       .upper = 1000,
       .start = 30},
      {.name = "shift", .role = ParameterRole::placement, .lower = -1, .upper = 1, .typical = 0.1},
      {.name = "rate",
       .role = ParameterRole::effect,
       .lower = 0,
       .upper = 10,
       .start = 5,
       .typical = 1}};
  problem.observations.push_back({.kind = "tracks3d", .unit = "m"});
  for (const double place_m : {0.0, 0.02})
    problem.observations.front().rows.push_back(
        {.frame = place_m > 0 ? 1 : 0, .marker = 0, .observed = {place_m, 0, 0}, .sigma = 1e-3});
  return problem;
}

/// A cost whose residual has the same length for both observations, a function of the coordinates.
class KnownCost final : public Objective {
 public:
  using Length = std::function<double(const Eigen::VectorXd& coordinates)>;

  KnownCost(const FitProblem& problem, Length length)
      : Objective(problem, TimeSteps(1)), length_(std::move(length)) {
    for (int frame = 0; frame < 2; ++frame)
      add_block({.set = 0, .row = frame, .marker = 0, .frame = frame, .dimension = 3});
  }

  std::string name() const override { return "known"; }
  double spring_steps_per_run() const override { return 1; }
  std::vector<Eigen::VectorXd> residuals(
      const std::vector<Eigen::VectorXd>& values) const override {
    std::vector<Eigen::VectorXd> all;
    for (const Eigen::VectorXd& of : values) {
      ++asked;
      others_stay = others_stay && of[1] == 0.25;
      const double length = length_(problem().space.coordinates(of));
      all.emplace_back();
      if (std::isnan(length)) continue;  // diverged
      all.back() = Eigen::VectorXd::Zero(6);
      all.back()[0] = all.back()[4] = length;
    }
    return all;
  }
  Linearisation linearise(const Eigen::VectorXd&) const override { return {}; }

  mutable std::atomic<long> asked = 0;
  mutable std::atomic<bool> others_stay = true;

 private:
  Length length_;
};

/// The optimum has the stiffness 100 and the rate 3.
const Eigen::Vector2d kOptimum(std::log(100.0), 3);

Eigen::Vector2d physical(const Eigen::VectorXd& coordinates) {
  return {coordinates[0], coordinates[2]};
}

/// A trough, along which both parameters nearly make up for each other.
double trough(const Eigen::VectorXd& coordinates) {
  const Eigen::Vector2d off = physical(coordinates) - kOptimum;
  return std::hypot(off[0] + off[1], 0.3 * (off[0] - off[1]));
}

/// Waves over a bowl. There is an optimum in every trough, the best one where the bowl is deepest.
double troughs(const Eigen::VectorXd& coordinates) {
  const Eigen::Vector2d off = physical(coordinates) - kOptimum;
  return 1 + off.squaredNorm() + 4 - 2 * std::cos(5 * off[0]) - 2 * std::cos(3 * off[1]);
}

/// Two bowls of one depth, far from each other.
const Eigen::Vector2d kTwin(std::log(3.0), 8);
double twins(const Eigen::VectorXd& coordinates) {
  return 1 + std::min((physical(coordinates) - kOptimum).squaredNorm(),
                      (physical(coordinates) - kTwin).squaredNorm());
}

FitOptions searching(SearchMethod method, unsigned long long seed = 61) {
  return {.seed = seed,
          .search = method,
          .population = 60,
          .generations = 40,
          .refine_best = 3,
          .stop_cost = 0};
}

/// Returns the problem's start with the placement off the middle of its range.
Eigen::VectorXd search_start(const FitProblem& problem) {
  Eigen::VectorXd values = problem.space.start();
  values[1] = 0.25;
  return values;
}

SearchedParameters found_in(const KnownCost& cost, const FitOptions& options,
                            const ProgressCallback& progress = {}) {
  return search_parameters(cost, options, search_start(cost.problem()), progress);
}

void expect_same_bits(const SearchedParameters& one, const SearchedParameters& other) {
  EXPECT_EQ(one.best_cost, other.best_cost);
  EXPECT_EQ(one.simulations, other.simulations);
  ASSERT_EQ(one.optima.size(), other.optima.size());
  for (size_t n = 0; n < one.optima.size(); ++n) {
    EXPECT_EQ(one.optima[n].values, other.optima[n].values);
    EXPECT_EQ(one.optima[n].cost, other.optima[n].cost);
    EXPECT_EQ(one.optima[n].runs, other.optima[n].runs);
  }
}

class SearchOptima : public testing::Test {
 protected:
  double off(const SearchOptimum& optimum, const Eigen::Vector2d& place) const {
    return (physical(problem_.space.coordinates(optimum.values)) - place).norm();
  }
  double most_apart(const SearchOptimum& one, const SearchOptimum& other) const {
    return (problem_.space.coordinates(one.values) - problem_.space.coordinates(other.values))
        .cwiseAbs()
        .maxCoeff();
  }

  FitProblem problem_ = searched_problem();
};

class ParameterSearch : public SearchOptima, public testing::WithParamInterface<SearchMethod> {
 protected:
  TemporaryFolder folder_;
};

TEST_P(ParameterSearch, FindsTheOptimumOfAValleyAndLeavesWhatIsNoPhysics) {
  SCOPED_TRACE("seed 61");
  const KnownCost cost(problem_, trough);

  const SearchedParameters found = found_in(cost, searching(GetParam()));

  ASSERT_FALSE(found.optima.empty());
  const SearchOptimum& best = found.optima.front();
  EXPECT_EQ(best.cost, trough(problem_.space.coordinates(best.values)));
  EXPECT_EQ(best.cost, found.best_cost.back());
  EXPECT_EQ(best.values[1], 0.25);
  EXPECT_TRUE(cost.others_stay);
  // The cost is some sigmas over the ranges. The paper's strategy crawls along a trough.
  EXPECT_LT(best.cost, GetParam() == SearchMethod::cma ? 0.02 : 0.2);
  for (size_t generation = 1; generation < found.best_cost.size(); ++generation)
    EXPECT_LE(found.best_cost[generation], found.best_cost[generation - 1]);
}

TEST_P(ParameterSearch, TakesAsManySimulationsAsItSays) {
  SCOPED_TRACE("seed 61");
  EXPECT_EQ(search_simulations({.population = 100, .generations = 40}), 2050);
  EXPECT_EQ(search_simulations({.population = 2, .generations = 1}), 2);
  const KnownCost cost(problem_, trough);
  const FitOptions options = searching(GetParam());

  const SearchedParameters found = found_in(cost, options);

  EXPECT_EQ(found.simulations, cost.asked);
  // CMA-ES ends with a whole generation, which may exceed the number.
  EXPECT_LE(found.simulations, search_simulations(options) + 256);
}

TEST_P(ParameterSearch, EndsOnceTheModelFollowsTheCloth) {
  SCOPED_TRACE("seed 61");
  const KnownCost cost(problem_, trough);
  // The marker was observed twice, and had moved by 20 sigmas the second time.
  ASSERT_NEAR(cost_of_following(cost), 0.05 * 10, 1e-12);
  FitOptions options = searching(GetParam());
  for (const double stop : {0.5, 2.0}) {
    SCOPED_TRACE(stop);
    options.stop_cost.reset();
    if (stop != 0.5) options.stop_cost = stop;  // which goes before

    const SearchedParameters found = found_in(cost, options);

    EXPECT_LE(found.best_cost.back(), stop);
    for (size_t generation = 0; generation + 1 < found.best_cost.size(); ++generation)
      EXPECT_GT(found.best_cost[generation], stop);
  }
}

TEST_P(ParameterSearch, IsTheSameForTheSameSeedAndAnotherForAnother) {
  const KnownCost cost(problem_, troughs);

  const SearchedParameters one = found_in(cost, searching(GetParam(), 62));

  expect_same_bits(one, found_in(cost, searching(GetParam(), 62)));
  EXPECT_NE(one.best_cost, found_in(cost, searching(GetParam(), 63)).best_cost);
}

TEST_P(ParameterSearch, GoesOnFromItsFileToTheSameBits) {
  SCOPED_TRACE("seed 61");
  const KnownCost cost(problem_, troughs);
  FitOptions options = searching(GetParam());
  options.population = 20;
  options.generations = 16;
  const SearchedParameters whole = found_in(cost, options);
  ASSERT_GT(whole.best_cost.size(), 8u);
  for (const size_t generation : {1u, 7u}) {
    SCOPED_TRACE(generation);
    FitOptions kept = options;
    kept.checkpoint = folder_.path() / std::to_string(generation);
    size_t told = 0;
    EXPECT_THROW(found_in(cost, kept, [&](const Progress&) { return ++told < generation; }),
                 StopRequested);
    EXPECT_EQ(told, generation);

    kept.resume = true;
    const SearchedParameters resumed = found_in(cost, kept);

    expect_same_bits(resumed, whole);
  }
}

// A cost depends on the observations and their sigmas, on the model, and on where it starts.
TEST_P(ParameterSearch, RefusesTheFileOfAnotherProblem) {
  FitOptions options = searching(GetParam());
  options.checkpoint = folder_.path() / "search";
  options.generations = 3;
  found_in(KnownCost(problem_, trough), options);
  options.resume = true;
  EXPECT_NO_THROW(found_in(KnownCost(problem_, trough), options));

  EXPECT_THROW(found_in(KnownCost(problem_, troughs), options), InputError);
  const auto expect_refused = [&](const auto& change) {
    FitProblem other = searched_problem();
    change(other);
    const KnownCost cost(other, trough);
    EXPECT_THROW(found_in(cost, options), InputError);
  };
  expect_refused([](FitProblem& other) { other.observations[0].rows[1].observed.x() += 1e-9; });
  expect_refused([](FitProblem& other) { other.observations[0].rows[1].sigma *= 2; });
  expect_refused([](FitProblem& other) { other.space.parameters[0].upper *= 2; });
  expect_refused([](FitProblem& other) { other.space.parameters[2].start += 1; });
  expect_refused([](FitProblem& other) { other.cloth.mesh.columns = 9; });
  options.seed += 1;
  EXPECT_THROW(found_in(KnownCost(problem_, trough), options), InputError);
}

TEST_P(ParameterSearch, RanksWhatDivergedLast) {
  SCOPED_TRACE("seed 61");
  // No model as stiff as the optimum runs.
  const auto half = [](const Eigen::VectorXd& coordinates) {
    return coordinates[0] > kOptimum[0] - 1 ? NAN : (physical(coordinates) - kOptimum).norm();
  };
  const KnownCost cost(problem_, half), nothing(problem_, [](const auto&) { return NAN; });

  const SearchedParameters found = found_in(cost, searching(GetParam()));
  const SearchedParameters none = found_in(nothing, searching(GetParam()));

  ASSERT_FALSE(found.optima.empty());
  EXPECT_NEAR(found.optima.front().cost, 1, 0.2);
  for (const SearchOptimum& optimum : found.optima) EXPECT_TRUE(std::isfinite(optimum.cost));
  EXPECT_TRUE(none.optima.empty());
  EXPECT_FALSE(none.message.empty());
}

// The last generation of the paper's strategy lies scattered.
TEST_F(SearchOptima, AreIndividualsThatDifferBestFirst) {
  SCOPED_TRACE("seed 61");
  const KnownCost cost(problem_, troughs);

  const SearchedParameters found = found_in(cost, searching(SearchMethod::paper));

  ASSERT_EQ(found.optima.size(), 3u);
  for (size_t n = 0; n < found.optima.size(); ++n) {
    EXPECT_EQ(found.optima[n].runs, 1);
    for (size_t before = 0; before < n; ++before) {
      EXPECT_GE(found.optima[n].cost, found.optima[before].cost);
      EXPECT_GT(most_apart(found.optima[n], found.optima[before]), kDifferentOptima);
    }
  }
}

TEST_F(SearchOptima, CountTheRunsOfCmaThatEndedThere) {
  SCOPED_TRACE("seed 61");
  FitOptions options = searching(SearchMethod::cma);
  options.population = 200;
  options.generations = 60;

  // Waves of that length hide the bowl from no run of CMA-ES.
  const SearchedParameters one = found_in(KnownCost(problem_, troughs), options);
  const SearchedParameters two = found_in(KnownCost(problem_, twins), options);

  ASSERT_EQ(one.optima.size(), 1u);
  EXPECT_GE(one.optima.front().runs, 3);
  EXPECT_LT(off(one.optima.front(), kOptimum), 0.05);
  ASSERT_EQ(two.optima.size(), 2u);
  EXPECT_GE(two.optima[1].cost, two.optima[0].cost);
  const bool is_twin_first = off(two.optima[0], kTwin) < 1;
  EXPECT_LT(off(two.optima[0], is_twin_first ? kTwin : kOptimum), 0.05);
  EXPECT_LT(off(two.optima[1], is_twin_first ? kOptimum : kTwin), 0.05);
}

INSTANTIATE_TEST_SUITE_P(ByEitherMethod, ParameterSearch,
                         testing::Values(SearchMethod::paper, SearchMethod::cma),
                         [](const auto& method) {
                           return method.param == SearchMethod::paper ? "paper" : "cma";
                         });

}  // namespace
}  // namespace clothfit
