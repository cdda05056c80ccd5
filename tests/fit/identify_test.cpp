// Checks the way to an optimum, search and refinement, on a cloth of 5 x 5 vertices. Not checked
// here: the search and the refinement by themselves (search/parameter_search_test.cpp,
// refine/refine_test.cpp), and the result of a fit (fit_test.cpp).
#include "fit/identify.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "data/input_error.h"
#include "fit/cost/objective.h"
#include "fit/cost/observed_motion.h"
#include "fit/jobs/stop_token.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

constexpr int kTinyMesh = 5, kTinyFrames = 14;

SyntheticCloth tiny_cloth(unsigned seed = 1) {
  return {.mesh = kTinyMesh,
          .markers = 5,
          .frames = kTinyFrames,
          .held_out_from = kTinyFrames,
          .seed = seed};
}

/// Returns options of a small search, with the loss for which an optimum's covariance is known.
FitOptions tiny_options() {
  FitOptions options;
  options.population = 24;
  options.generations = 8;
  options.refine_best = 2;
  options.loss = Loss::squared;
  return options;
}

struct Identified {
  FitProblem problem;
  RefineResult optimum;
  FitReport report;
  std::vector<Candidate> candidates;

  /// Returns the information about the coordinates, by the derivatives at the optimum.
  Eigen::MatrixXd information() const {
    return optimum.residual_by_coordinate.transpose() * optimum.residual_by_coordinate;
  }
  Eigen::VectorXd coordinates() const { return problem.space.coordinates(optimum.values); }
};

Identified identified(const FitInput& input, const FitOptions& options,
                      const ProgressCallback& progress = {}, int mesh = kTinyMesh) {
  Identified found{.problem = make_problem(input, options, mesh, mesh)};
  found.optimum = identify(input, found.problem, options, progress, found.report, found.candidates);
  return found;
}

/// The error of the fabric's coordinates, and its covariance by the derivatives.
struct FabricError {
  Eigen::VectorXd off;
  Eigen::MatrixXd covariance;
};

FabricError fabric_error(const Identified& found) {
  const Eigen::VectorXd truth =
      found.problem.space.coordinates(start_with(found.problem, SyntheticCloth().fabric));
  std::vector<int> places;
  for (const auto& [name, value] : named(SyntheticCloth().fabric))
    places.push_back(found.problem.space.index(name));
  const Eigen::MatrixXd covariance =
      found.information().ldlt().solve(Eigen::MatrixXd::Identity(truth.size(), truth.size()));
  return {.off = (found.coordinates() - truth)(places), .covariance = covariance(places, places)};
}

// The fit knows no number of the fabric but the ranges that follow from the cloth's weight.
TEST(Identify, RecoversTheFabricFromTheMiddleOfTheRanges) {
  SCOPED_TRACE("seed 1");
  FitOptions options = tiny_options();
  options.start.emplace();
  options.substep_scale = 6;  // as fine as the truth's

  const Identified found = identified(synthetic_input(tiny_cloth()), options);

  ASSERT_TRUE(found.optimum.usable && found.optimum.converged) << found.optimum.message;
  const FabricError error = fabric_error(found);
  const Eigen::VectorXd sigma = error.covariance.diagonal().cwiseSqrt();
  EXPECT_LT(error.off.cwiseQuotient(sigma).cwiseAbs().maxCoeff(), 4);
  // The least known one, a damping, is known to a half of itself. Its range spans three decades.
  EXPECT_LT(sigma.maxCoeff(), 0.5);
  // The noise alone remains. Each parameter takes one residual's worth of it.
  const auto rows = static_cast<double>(found.optimum.residual_by_coordinate.rows());
  const double left = 1 - found.problem.space.size() / rows;
  EXPECT_NEAR(2 * found.optimum.cost, left, 4 * std::sqrt(2 / rows));
}

// The squared errors of the seven numbers, in units of their covariance, add up to their number.
TEST(Identify, ErrsByWhatTheDerivativesAtTheOptimumSay) {
  SCOPED_TRACE("seeds 1 to 6");
  FitOptions options = tiny_options();
  options.start = named(SyntheticCloth().fabric);
  options.substep_scale = 6;
  double squares = 0;
  int numbers = 0;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const Identified found = identified(synthetic_input(tiny_cloth(seed)), options);
    ASSERT_TRUE(found.optimum.usable) << seed;
    const FabricError error = fabric_error(found);
    squares += error.off.dot(error.covariance.ldlt().solve(error.off));
    numbers += static_cast<int>(error.off.size());
  }

  EXPECT_EQ(numbers, 6 * 7);
  EXPECT_NEAR(squares, numbers, 4 * std::sqrt(2.0 * numbers));
}

/// A way to the optimum.
struct Way {
  std::string name;
  FitOptions options;
  bool searches = false;
  std::string first_stage;
};

void PrintTo(const Way& way, std::ostream* out) {
  *out << way.name;
}

std::vector<Way> ways() {
  std::vector<Way> all;
  all.push_back({"strategy", tiny_options(), true, "evolutionary search"});
  all.push_back({"cma", tiny_options(), true, "CMA-ES"});
  all.back().options.search = SearchMethod::cma;
  all.push_back({"middle", tiny_options(), false, "refinement"});
  all.back().options.start.emplace();
  for (const LeadingCost cost : {LeadingCost::shooting, LeadingCost::full, LeadingCost::small}) {
    all.push_back({to_string(cost), tiny_options(), false, to_string(cost)});
    all.back().options.cost = cost;
  }
  return all;
}

class IdentifyWay : public testing::TestWithParam<Way> {};

TEST_P(IdentifyWay, LeadsToTheOptimumThatTheTruthLeadsTo) {
  SCOPED_TRACE("seed 1");
  const FitInput input = synthetic_input(tiny_cloth());
  FitOptions from_truth = tiny_options();
  from_truth.start = named(SyntheticCloth().fabric);
  const Identified expected = identified(input, from_truth);
  ASSERT_TRUE(expected.optimum.converged) << expected.optimum.message;

  const Identified found = identified(input, GetParam().options);

  ASSERT_TRUE(found.optimum.usable && found.optimum.converged) << found.optimum.message;
  EXPECT_THAT(found.report.stages.front(), testing::StartsWith(GetParam().first_stage));
  EXPECT_EQ(found.report.search_cost.empty(), !GetParam().searches);
  EXPECT_EQ(found.candidates.empty(), !GetParam().searches);
  // Each way ends with time steps of its own. They differ by some percent and shift the optimum by
  // less than a fifth of a sigma.
  const Eigen::VectorXd off = found.coordinates() - expected.coordinates();
  EXPECT_LT(off.dot(expected.information() * off), 0.2 * 0.2);
  EXPECT_NEAR(found.optimum.cost, expected.optimum.cost, 1e-3 * expected.optimum.cost);
}

INSTANTIATE_TEST_SUITE_P(Whichever, IdentifyWay, testing::ValuesIn(ways()),
                         [](const auto& way) { return way.param.name; });

// A search looks at half the cells a side, 7 x 7 vertices at least, and at the first frames.
TEST(Identify, LeadsFromACoarseMeshAndFewFramesToItsOwnMeshAndAllFrames) {
  SCOPED_TRACE("seed 1");
  const FitInput input =
      synthetic_input({.mesh = 9, .markers = 4, .frames = 14, .held_out_from = 14});
  FitOptions options = tiny_options();
  const Identified found = identified(input, options, {}, 9);
  options.start = named(SyntheticCloth().fabric);
  const Identified expected = identified(input, options, {}, 9);

  ASSERT_TRUE(found.optimum.usable && found.optimum.converged) << found.optimum.message;
  const std::vector<std::string>& stages = found.report.stages;
  EXPECT_THAT(stages.front(), testing::HasSubstr("mesh 7 x 7, 8 frames"));
  EXPECT_THAT(stages, testing::Contains(testing::HasSubstr(
                          "refinement on 9 x 9 with the coarse mesh's derivatives over 8 frames")));
  EXPECT_THAT(stages, testing::Contains(testing::HasSubstr("refinement on 9 x 9 over 14 frames")));
  // Few frames leave a trough so flat that the two ways may end a sigma apart in it.
  const Eigen::VectorXd off = found.coordinates() - expected.coordinates();
  EXPECT_LT(off.dot(expected.information() * off), 2 * 2);
  EXPECT_NEAR(found.optimum.cost, expected.optimum.cost, 0.01 * expected.optimum.cost);
}

TEST(Identify, SearchesWhereAGivenStartLeadsToNoOptimum) {
  SCOPED_TRACE("seed 1");
  const FitInput input = synthetic_input(tiny_cloth());
  FitOptions options = tiny_options();
  options.start.emplace();
  options.work = 1e-9;  // each stage ends after a step or two

  const Identified found = identified(input, options);
  options.start.reset();
  const Identified searched = identified(input, options);

  EXPECT_THAT(found.report.stages, testing::Contains("the given start leads to no optimum"));
  EXPECT_THAT(searched.report.stages,
              testing::Not(testing::Contains("the given start leads to no optimum")));
  ASSERT_TRUE(found.optimum.usable);
  // The result is the better of the two. A step or two from the middle of the ranges lead nowhere.
  EXPECT_EQ(found.report.search_cost, searched.report.search_cost);
  EXPECT_EQ(found.optimum.values, searched.optimum.values);
}

TEST(Identify, PutsAGivenStartWithinTheRangesAndRefusesUnknownNames) {
  SCOPED_TRACE("seed 1");
  const FitInput input = synthetic_input(tiny_cloth());
  FitOptions options = tiny_options();
  const FitProblem problem = make_problem(input, options, kTinyMesh, kTinyMesh);
  const FitParameter& shear =
      problem.space.parameters[static_cast<size_t>(problem.space.index("shear"))];
  const auto from = [&](double value) {
    options.start = named(SyntheticCloth().fabric);
    (*options.start)["shear"] = value;
    return identified(input, options).optimum.values;
  };

  EXPECT_EQ(from(3 * shear.upper), from(shear.upper));

  (*options.start)["sheer"] = 18;
  EXPECT_THROW(identified(input, options), InputError);
}

// The best individuals are refined, up to the first that follows the cloth.
TEST(Identify, HandsOnWhatTheSearchFound) {
  SCOPED_TRACE("seed 1");
  for (const double noise_m : {2e-4, 5e-4}) {
    SCOPED_TRACE(noise_m);
    SyntheticCloth cloth = tiny_cloth();
    cloth.noise_m = noise_m;
    FitOptions options = tiny_options();
    options.population = 40;
    options.generations = 6;
    options.refine_best = 4;
    options.stop_cost = 0;

    const Identified found = identified(synthetic_input(cloth), options);

    ASSERT_TRUE(found.optimum.usable);
    EXPECT_EQ(found.report.search_cost.size(), 6u);
    ASSERT_FALSE(found.candidates.empty());
    ASSERT_LE(found.candidates.size(), 4u);
    const TrajectoryObjective window(found.problem, 8, 1e-3);
    const double following = cost_of_following(window);
    bool enough = false;
    for (size_t n = 0; n < found.candidates.size(); ++n) {
      const Candidate& candidate = found.candidates[n];
      EXPECT_EQ(candidate.refined, !enough) << n;
      EXPECT_EQ(candidate.runs, 1) << n;
      if (candidate.refined) {
        enough = candidate.cost < following;
        // It began at the search's best or at a worse one.
        EXPECT_LT(candidate.cost, found.report.search_cost.back()) << n;
      } else if (!found.candidates[n - 1].refined) {
        EXPECT_GE(candidate.cost, found.candidates[n - 1].cost) << n;
      }
      for (int p = 0; p < found.problem.space.size(); ++p) {
        const FitParameter& parameter = found.problem.space.parameters[static_cast<size_t>(p)];
        EXPECT_GE(candidate.values[p], parameter.lower * (1 - 1e-12)) << parameter.name;
        EXPECT_LE(candidate.values[p], parameter.upper * (1 + 1e-12)) << parameter.name;
      }
    }
    // Less noise makes the motion larger in sigmas.
    EXPECT_EQ(enough, noise_m < 3e-4);
  }
}

TEST(Identify, IsTheSameForTheSameSeed) {
  SCOPED_TRACE("seed 1");
  const FitInput input = synthetic_input(tiny_cloth());

  const Identified one = identified(input, tiny_options()),
                   again = identified(input, tiny_options());

  EXPECT_EQ(one.optimum.values, again.optimum.values);
  EXPECT_EQ(one.optimum.cost, again.optimum.cost);
  EXPECT_EQ(one.report.stages, again.report.stages);
  EXPECT_EQ(one.report.search_cost, again.report.search_cost);
}

TEST(Identify, EndsWhereverItIsToldTo) {
  const FitInput input = synthetic_input(tiny_cloth());
  int calls = 0;
  identified(input, tiny_options(), [&](const Progress&) { return ++calls > 0; });
  ASSERT_GT(calls, 20);
  // The calls are in the search, behind it, and at the very end.
  for (const int last : {1, 9, calls - 1}) {
    SCOPED_TRACE(last);
    int told = 0;
    EXPECT_THROW(identified(input, tiny_options(), [&](const Progress&) { return ++told < last; }),
                 StopRequested);
    EXPECT_EQ(told, last);
  }
}

// The limit of work is meant for twenty coordinates. A start in motion has hundreds.
TEST(Identify, AllowsTheLastStageMoreWorkForMoreCoordinates) {
  FitProblem problem;
  FitOptions options = tiny_options();
  problem.space.parameters.resize(10);
  const double usual = final_refinement(problem, options).most_spring_steps;
  EXPECT_GT(usual, 0);
  problem.space.parameters.resize(20);
  EXPECT_DOUBLE_EQ(final_refinement(problem, options).most_spring_steps, usual);
  problem.space.parameters.resize(200);
  EXPECT_DOUBLE_EQ(final_refinement(problem, options).most_spring_steps, 6 * usual);
  options.work = 0.5;
  EXPECT_DOUBLE_EQ(final_refinement(problem, options).most_spring_steps, 3 * usual);
  problem.space.parameters.resize(80);
  EXPECT_DOUBLE_EQ(final_refinement(problem, options).most_spring_steps, 2 * usual);

  options.loss = Loss::huber;
  options.substep_scale = 3;
  const RefineOptions last = final_refinement(problem, options);
  EXPECT_EQ(last.loss, Loss::huber);
  EXPECT_EQ(last.substep_scale, 3);
  EXPECT_EQ(last.derivatives, Derivatives::tangents);
  EXPECT_TRUE(last.exact_in_the_end);
}

}  // namespace
}  // namespace clothfit
