// Checks the founding paper's search on costs given by formulas. Not checked here: costs that
// simulate a cloth (trajectory_cost_test.cpp), and the refinement that follows the search
// (refine_test.cpp).

#include "fit/search/evolutionary_strategy.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <numbers>
#include <set>

#include "data/input_error.h"

namespace clothfit {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

std::vector<SearchParameter> unit_ranges(int count) {
  std::vector<SearchParameter> parameters;
  for (int p = 0; p < count; ++p) parameters.push_back({.name = std::to_string(p)});
  return parameters;
}

/// Returns the squared distance to a point off the centre of the unit cube.
Eigen::VectorXd sphere(const Eigen::MatrixXd& individuals) {
  return (individuals.array() - 0.3).square().colwise().sum();
}

GenerationCost one_by_one(const std::function<double(const Eigen::VectorXd&)>& cost) {
  return [cost](const Eigen::MatrixXd& individuals) {
    Eigen::VectorXd costs(individuals.cols());
    for (Eigen::Index k = 0; k < individuals.cols(); ++k) costs(k) = cost(individuals.col(k));
    return costs;
  };
}

/// Stops only at the last generation.
EvolutionOptions all_generations(int generations, unsigned long long seed) {
  EvolutionOptions options;
  options.generations = generations;
  options.least_gain = 0;
  options.seed = seed;
  return options;
}

bool same_bytes(const EvolutionState& a, const EvolutionState& b) {
  const auto equal_vectors = [](const double* x, const double* y, size_t n) {
    return std::memcmp(x, y, n * sizeof(double)) == 0;
  };
  if (a.population.size() != b.population.size() || a.best_cost.size() != b.best_cost.size() ||
      a.evaluations != b.evaluations)
    return false;
  for (size_t k = 0; k < a.population.size(); ++k) {
    const Individual& one = a.population[k];
    const Individual& other = b.population[k];
    if (one.origin != other.origin || one.parent_ranks != other.parent_ranks ||
        !equal_vectors(&one.cost, &other.cost, 1) ||
        !equal_vectors(one.values.data(), other.values.data(),
                       static_cast<size_t>(one.values.size())))
      return false;
  }
  return equal_vectors(a.best_cost.data(), b.best_cost.data(), a.best_cost.size());
}

TEST(EvolutionaryStrategy, HasThePapersShares) {
  const EvolutionOptions options;

  EXPECT_EQ(options.population, 100);
  EXPECT_EQ(options.kept_count(), 50);
  EXPECT_EQ(options.mutated_count(), 20);
  EXPECT_EQ(options.crossed_count(), 30);
  EXPECT_EQ(options.mutation_parent_count(), 80);
}

TEST(EvolutionaryStrategy, ReplacesTheWorseHalfByTheParentRulesOfThePaper) {
  const int parameter_count = 5;
  const auto parameters = unit_ranges(parameter_count);
  const EvolutionOptions options = all_generations(40, 7);
  EvolutionState before = first_generation(parameters, options, sphere);

  std::set<int> mutation_parents, crossover_parents;
  std::map<int, int> mutated_parameter_count;
  while (before.generations() < options.generations) {
    const EvolutionState after = next_generation(parameters, options, sphere, before);

    std::map<Origin, int> count;
    std::set<int> kept_ranks;
    for (const Individual& individual : after.population) {
      ++count[individual.origin];
      const auto parent = [&](size_t k) -> const Individual& {
        return before.population[static_cast<size_t>(individual.parent_ranks.at(k))];
      };
      switch (individual.origin) {
        case Origin::kept:
          ASSERT_EQ(individual.parent_ranks.size(), 1u);
          EXPECT_EQ(individual.values, parent(0).values);
          EXPECT_EQ(individual.cost, parent(0).cost);
          kept_ranks.insert(individual.parent_ranks[0]);
          break;
        case Origin::mutated: {
          ASSERT_EQ(individual.parent_ranks.size(), 1u);
          mutation_parents.insert(individual.parent_ranks[0]);
          int changed = 0;
          for (int p = 0; p < parameter_count; ++p) {
            if (individual.values(p) != parent(0).values(p)) {
              ++changed;
              ++mutated_parameter_count[p];
            }
          }
          EXPECT_EQ(changed, 1);
          break;
        }
        case Origin::crossed: {
          ASSERT_EQ(individual.parent_ranks.size(), static_cast<size_t>(parameter_count));
          crossover_parents.insert(individual.parent_ranks.begin(), individual.parent_ranks.end());
          for (int p = 0; p < parameter_count; ++p) {
            bool inherited = false;
            for (size_t k = 0; k < individual.parent_ranks.size(); ++k)
              inherited = inherited || individual.values(p) == parent(k).values(p);
            EXPECT_TRUE(inherited);
          }
          break;
        }
        default:
          ADD_FAILURE() << "an individual without parents in a later generation";
      }
    }
    EXPECT_EQ(count[Origin::kept], 50);
    EXPECT_EQ(count[Origin::mutated], 20);
    EXPECT_EQ(count[Origin::crossed], 30);
    EXPECT_EQ(kept_ranks.size(), 50u);
    EXPECT_EQ(*kept_ranks.rbegin(), 49);  // the 50 best, each once
    EXPECT_EQ(after.evaluations, before.evaluations + 50);
    before = after;
  }

  // In 780 draws of 80 ranks and 5850 of 50 all of them are met, none beyond.
  EXPECT_EQ(mutation_parents.size(), 80u);
  EXPECT_EQ(*mutation_parents.rbegin(), 79);
  EXPECT_EQ(crossover_parents.size(), 50u);
  EXPECT_EQ(*crossover_parents.rbegin(), 49);
  // 780 mutations over five parameters are 156 each, with a standard deviation of 11.2.
  for (int p = 0; p < parameter_count; ++p) EXPECT_NEAR(mutated_parameter_count[p], 156, 4 * 11.2);
}

TEST(EvolutionaryStrategy, AsksForTheCostOfNewIndividualsOnly) {
  std::vector<Eigen::Index> asked;
  const GenerationCost counting = [&](const Eigen::MatrixXd& individuals) {
    asked.push_back(individuals.cols());
    return sphere(individuals);
  };

  const EvolutionResult result = evolve(unit_ranges(3), all_generations(4, 1), counting);

  EXPECT_THAT(asked, testing::ElementsAre(100, 50, 50, 50));
  EXPECT_EQ(result.state.evaluations, 250);
}

TEST(EvolutionaryStrategy, KeepsItsPopulationRankedAndItsBestCostFalling) {
  const EvolutionResult result = evolve(unit_ranges(4), all_generations(30, 3), sphere);

  const auto by_cost = [](const Individual& a, const Individual& b) { return a.cost < b.cost; };
  EXPECT_TRUE(
      std::is_sorted(result.state.population.begin(), result.state.population.end(), by_cost));
  EXPECT_TRUE(std::is_sorted(result.state.best_cost.rbegin(), result.state.best_cost.rend()));
  EXPECT_EQ(result.best().cost, result.state.best_cost.back());
  EXPECT_EQ(sphere(result.best().values)(0), result.best().cost);
  EXPECT_EQ(result.state.generations(), 30);
}

TEST(EvolutionaryStrategy, SameSeedGivesTheSameBytesAndAnotherSeedDoesNot) {
  const auto parameters = unit_ranges(5);

  const auto one = evolve(parameters, all_generations(20, 42), sphere);
  const auto again = evolve(parameters, all_generations(20, 42), sphere);
  const auto other = evolve(parameters, all_generations(20, 43), sphere);

  EXPECT_TRUE(same_bytes(one.state, again.state));
  EXPECT_FALSE(same_bytes(one.state, other.state));
}

TEST(EvolutionaryStrategy, KeepsItsStreamOfRandomNumbersFromVersionToVersion) {
  // A changed value here means that every earlier search can no longer be repeated.
  const auto state = first_generation(unit_ranges(2), all_generations(1, 1), sphere);

  EXPECT_DOUBLE_EQ(state.best_cost[0], 0.0033384811192606599);
}

TEST(EvolutionaryStrategy, ResumedSearchEqualsAnUninterruptedOne) {
  const auto parameters = unit_ranges(4);
  EvolutionOptions options = all_generations(25, 5);
  const EvolutionResult uninterrupted = evolve(parameters, options, sphere);

  int told = 0;
  const EvolutionResult first =
      evolve(parameters, options, sphere, [&](const Progress&) { return ++told < 9; });
  const EvolutionResult rest = resume_evolution(parameters, options, sphere, first.state);

  EXPECT_EQ(first.stop, EvolutionStop::cancelled);
  EXPECT_EQ(first.state.generations(), 9);
  EXPECT_EQ(rest.stop, EvolutionStop::reached_generations);
  EXPECT_TRUE(same_bytes(rest.state, uninterrupted.state));
}

TEST(EvolutionaryStrategy, FirstGenerationIsUniformOverTheRangesLinearOrLogarithmic) {
  const std::vector<SearchParameter> parameters = {
      {.name = "angle", .lower = -2, .upper = 6},
      {.name = "stiffness", .lower = 1e-2, .upper = 1e4, .log_scale = true}};
  EvolutionOptions options = all_generations(1, 11);
  options.population = 4000;

  const EvolutionState state = first_generation(parameters, options, sphere);

  // The mean of a uniform number over a range r is the middle, with a standard error of r / sqrt(12
  // n).
  double mean = 0, mean_log10 = 0;
  for (const Individual& individual : state.population) {
    mean += individual.values(0) / options.population;
    mean_log10 += std::log10(individual.values(1)) / options.population;
  }
  EXPECT_NEAR(mean, 2, 4 * 8 / std::sqrt(12 * 4000.0));
  EXPECT_NEAR(mean_log10, 1, 4 * 6 / std::sqrt(12 * 4000.0));
}

TEST(EvolutionaryStrategy, StaysWithinTheRanges) {
  const std::vector<SearchParameter> parameters = {
      {.name = "a", .lower = -3, .upper = -1},
      {.name = "b", .lower = 0.1, .upper = 0.3, .log_scale = true}};
  for (const MutationLaw law : {MutationLaw::redraw, MutationLaw::gaussian}) {
    EvolutionOptions options = all_generations(30, 2);
    options.mutation = law;
    options.mutation_step = 2;  // most steps leave the range and are reflected
    long asked = 0;
    const GenerationCost watching = [&](const Eigen::MatrixXd& individuals) {
      EXPECT_GE(individuals.row(0).minCoeff(), -3);
      EXPECT_LE(individuals.row(0).maxCoeff(), -1);
      EXPECT_GE(individuals.row(1).minCoeff(), 0.1);
      EXPECT_LE(individuals.row(1).maxCoeff(), 0.3);
      asked += individuals.cols();
      return sphere(individuals);  // pulls towards a corner of the ranges
    };

    const Eigen::Vector2d outside(7, 0.01);
    const EvolutionResult result = evolve(parameters, options, watching, {}, {outside});

    EXPECT_EQ(asked, 100 + 29 * 50);
    EXPECT_EQ(result.state.evaluations, asked);
  }
}

TEST(EvolutionaryStrategy, StartsFromGivenIndividuals) {
  const Eigen::Vector3d good(0.3, 0.3, 0.30001);

  const EvolutionState state =
      first_generation(unit_ranges(3), all_generations(1, 4), sphere, {good});

  EXPECT_EQ(state.population.front().values, good);
  EXPECT_EQ(state.population.front().origin, Origin::given);
  EXPECT_EQ(state.population.size(), 100u);
}

TEST(EvolutionaryStrategy, FindsTheBottomOfASphere) {
  // Redrawing one of five parameters over its whole range tries each about four times a generation.
  // Over 99 generations the nearest of some 400 draws, selection and crossover included, lies well
  // within a hundredth of the range.
  for (unsigned long long seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    const EvolutionResult result = evolve(unit_ranges(5), all_generations(100, seed), sphere);

    EXPECT_EQ(result.state.evaluations, 5050);
    EXPECT_LT((result.best().values.array() - 0.3).abs().maxCoeff(), 0.02);
  }
}

TEST(EvolutionaryStrategy, GaussianMutationRefinesFurther) {
  double redraw = 0, gaussian = 0;
  for (unsigned long long seed = 1; seed <= 10; ++seed) {
    EvolutionOptions options = all_generations(100, seed);
    redraw += std::log(evolve(unit_ranges(5), options, sphere).best().cost);
    options.mutation = MutationLaw::gaussian;
    options.mutation_step = 0.02;
    gaussian += std::log(evolve(unit_ranges(5), options, sphere).best().cost);
  }

  EXPECT_LT(gaussian, redraw - 10 * std::log(2.0));
}

TEST(EvolutionaryStrategy, FindsStiffnessesOnALogarithmicScaleThroughAnEllipsoid) {
  std::vector<SearchParameter> parameters;
  for (int p = 0; p < 4; ++p)
    parameters.push_back(
        {.name = std::to_string(p), .lower = 0.1, .upper = 1000, .log_scale = true});
  const Eigen::Vector4d truth(40, 6, 0.5, 300);
  const GenerationCost ellipsoid = one_by_one([&](const Eigen::VectorXd& k) {
    const Eigen::Array4d off = (k.array() / truth.array()).log();
    return (off.square() * Eigen::Array4d(1, 10, 100, 1000)).sum();
  });
  for (unsigned long long seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    const EvolutionResult result = evolve(parameters, all_generations(100, seed), ellipsoid);

    // Four decades are searched; within 40 % in the softest direction, 5 % in the stiffest.
    const Eigen::Array4d off = (result.best().values.array() / truth.array()).log().abs();
    EXPECT_LT(off(0), 0.4);
    EXPECT_LT(off(3), 0.05);
  }
}

TEST(EvolutionaryStrategy, LeavesLocalMinima) {
  // Rastrigin's function over [-5.12, 5.12]^5 has about 10^5 local minima, one at every whole
  // number.
  std::vector<SearchParameter> parameters = unit_ranges(5);
  for (SearchParameter& parameter : parameters) {
    parameter.lower = -5.12;
    parameter.upper = 5.12;
  }
  const GenerationCost rastrigin = one_by_one([](const Eigen::VectorXd& x) {
    return (x.array().square() - 10 * (2 * std::numbers::pi * x.array()).cos() + 10).sum();
  });
  int found = 0;
  for (unsigned long long seed = 1; seed <= 10; ++seed) {
    const EvolutionResult result = evolve(parameters, all_generations(150, seed), rastrigin);
    if (result.best().values.cwiseAbs().maxCoeff() < 0.5) ++found;
  }
  EXPECT_GE(found, 9);  // in the basin of the global minimum
}

TEST(EvolutionaryStrategy, CostsThatAreNotFiniteRankLast) {
  const GenerationCost half_diverges = one_by_one([](const Eigen::VectorXd& x) {
    if (x(0) > 0.5) return x(0) > 0.75 ? kNan : -std::numeric_limits<double>::infinity();
    return (x.array() - 0.3).square().sum();
  });

  const EvolutionResult result = evolve(unit_ranges(3), all_generations(20, 6), half_diverges);

  ASSERT_TRUE(result.usable());
  EXPECT_LT(result.best().values(0), 0.5);
  EXPECT_TRUE(std::isfinite(result.best().cost));
  bool finite_so_far = true;
  for (const Individual& individual : result.state.population) {
    EXPECT_FALSE(std::isnan(individual.cost));
    EXPECT_TRUE(finite_so_far || !std::isfinite(individual.cost));
    finite_so_far = std::isfinite(individual.cost);
  }
}

TEST(EvolutionaryStrategy, SaysWhenNothingIsFinite) {
  EvolutionOptions options;
  options.gain_window = 5;

  const EvolutionResult result =
      evolve(unit_ranges(2), options, one_by_one([](const Eigen::VectorXd&) { return kNan; }));

  EXPECT_FALSE(result.usable());
  EXPECT_EQ(result.stop, EvolutionStop::no_gain);
  EXPECT_EQ(result.state.generations(), 6);
  EXPECT_THAT(result.message, testing::HasSubstr("no individual has a finite cost"));
}

TEST(EvolutionaryStrategy, StopsOnTheCost) {
  EvolutionOptions options = all_generations(100, 1);
  options.cost_below = 0.02;

  const EvolutionResult result = evolve(unit_ranges(4), options, sphere);

  EXPECT_EQ(result.stop, EvolutionStop::cost_below);
  EXPECT_LE(result.best().cost, 0.02);
  ASSERT_GE(result.state.generations(), 2);
  EXPECT_GT(result.state.best_cost[result.state.best_cost.size() - 2], 0.02);
}

TEST(EvolutionaryStrategy, StopsWhenTheBestCostNoLongerFalls) {
  // The cost cannot fall below 1: once it is within a thousandth of that, nothing is gained.
  EvolutionOptions options;
  options.generations = 1000;
  const GenerationCost floored =
      one_by_one([](const Eigen::VectorXd& x) { return 1 + (x.array() - 0.3).square().sum(); });

  const EvolutionResult result = evolve(unit_ranges(3), options, floored);

  EXPECT_EQ(result.stop, EvolutionStop::no_gain);
  EXPECT_LT(result.state.generations(), 100);
  EXPECT_LT(result.best().cost, 1.01);
}

TEST(EvolutionaryStrategy, MeasuresHowFarItsIndividualsDiffer) {
  const std::vector<SearchParameter> parameters = {
      {.name = "a", .lower = 0, .upper = 2},
      {.name = "b", .lower = 1, .upper = 100, .log_scale = true}};
  EvolutionState state;
  for (const double share : {0.0, 1.0})
    state.population.push_back({.values = Eigen::Vector2d(1, share == 0 ? 1 : 100), .cost = 1});

  // The first parameter does not vary; the second lies at both ends of its range.
  EXPECT_NEAR(diversity(parameters, state), 0.5 * (0 + 0.5), 1e-15);

  // A uniform draw has 1 / sqrt(12); a thousand individuals are off by a few per cent.
  EvolutionOptions options = all_generations(1, 3);
  options.population = 1000;
  const EvolutionState drawn = first_generation(unit_ranges(3), options, sphere);
  EXPECT_NEAR(diversity(unit_ranges(3), drawn), 1 / std::sqrt(12.0), 0.01);
}

TEST(EvolutionaryStrategy, RefusesRangesThatMakeNoSense) {
  const auto refused = [](const std::vector<SearchParameter>& parameters) {
    EXPECT_THROW(evolve(parameters, all_generations(2, 1), sphere), InputError);
  };
  refused({});
  refused({{.name = "a", .lower = 1, .upper = 1}});
  refused({{.name = "a", .lower = kNan, .upper = 1}});
  refused({{.name = "a", .lower = 0, .upper = 1, .log_scale = true}});
}

}  // namespace
}  // namespace clothfit
