// Several recordings of one cloth in one fit. What a single recording's residuals and derivatives
// are is checked in objective_test.cpp; what a pool of misspecified fits is good for, in
// tests/apps/misspecified_drag_test.cpp.
#include "fit/pooled_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "data/input_error.h"
#include "fit/parameterised_model.h"
#include "model/stability.h"
#include "synthetic_cloth.h"

namespace clothfit {
namespace {

SyntheticCloth tiny(unsigned seed) {
  return {
      .mesh = 5, .markers = 5, .frames = 20, .held_out_from = 20, .noise_m = 5e-4, .seed = seed};
}

std::map<std::string, double> truth() {
  return named(SyntheticCloth{}.fabric);
}

Eigen::VectorXd true_values(const FitProblem& problem) {
  return start_with(problem, SyntheticCloth{}.fabric);
}

/// The problem's observations without noise: where the model with the true fabric has the markers,
/// the sheet being turned and shifted a little as `seed` has it.
void make_exact(FitProblem& problem, unsigned seed) {
  std::mt19937_64 generator(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  Eigen::VectorXd values = true_values(problem);
  for (const Binding& binding : problem.sheet_motion)
    values[binding.parameter] = 2e-3 * uniform(generator);
  const double time_step_s =
      stable_time_step_s(problem.cloth, parameter_set(problem, values)) / 1.5;
  const auto markers = marker_positions(
      problem.vertex_weights,
      run_model(problem, {values}, problem.frames(), time_step_s).front().position_m);
  for (Observation& row : problem.observations.front().rows)
    row.observed = markers[static_cast<size_t>(row.frame)].col(row.marker);
}

TEST(PooledCost, HasTheGradientThatDifferencesOfTheCostShow) {
  // Given two recordings, one with an uncertain vertical, off the optimum
  const FitProblem first = make_problem(synthetic_input(tiny(1)), {}, 5, 5);
  FitInput seen = synthetic_input(tiny(2));
  seen.cameras[0].camera_from_world->covariance = Eigen::Matrix<double, 6, 6>::Identity() * 9e-6;
  const FitProblem second = make_problem(seen, {.observations = ObservationKind::tracks2d}, 5, 5);
  const FitProblem* const problems[] = {&first, &second};
  const PooledCost cost(problems, {1e-3, 1e-3});
  ASSERT_EQ(cost.shared(), 7);
  ASSERT_EQ(cost.size(), 7 + 6 + 8);  // each its sheet's pose; the second its vertical too
  std::mt19937_64 generator(5);
  std::uniform_real_distribution<double> uniform(-0.2, 0.2);
  Eigen::VectorXd x = cost.coordinates({true_values(first), true_values(second)});
  for (double& coordinate : x) coordinate += uniform(generator);

  const PooledCost::Expansion expansion = cost.expand(x);

  ASSERT_TRUE(expansion.usable);
  EXPECT_NEAR(expansion.cost, cost.at(x), 1e-9 * expansion.cost);
  for (int p = 0; p < cost.size(); ++p) {
    SCOPED_TRACE(p);
    Eigen::VectorXd above = x, below = x;
    above[p] += 1e-4;
    below[p] -= 1e-4;
    const double difference = (cost.at(above) - cost.at(below)) / 2e-4;
    // Truncation of the difference is its step's square, 1e-8, times the cost's third derivative.
    EXPECT_NEAR(expansion.gradient[p], difference, 1e-5 * expansion.gradient.cwiseAbs().maxCoeff());
  }
}

TEST(PooledCost, StepsAsTheWholeSystemOfEquationsSays) {
  const FitProblem first = make_problem(synthetic_input(tiny(1)), {}, 5, 5);
  const FitProblem second = make_problem(synthetic_input(tiny(2)), {}, 5, 5);
  const FitProblem* const problems[] = {&first, &second};
  const PooledCost cost(problems, {1e-3, 1e-3});
  const PooledCost::Expansion e =
      cost.expand(cost.coordinates({true_values(first), true_values(second)}));
  ASSERT_TRUE(e.usable);
  std::vector<bool> held(static_cast<size_t>(cost.size()), false);
  held[2] = held[9] = true;

  const Eigen::VectorXd step = cost.step(e, 0.1, held);

  Eigen::MatrixXd whole = Eigen::MatrixXd::Zero(19, 19);
  whole.topLeftCorner(7, 7) = e.shared;
  for (int n = 0; n < 2; ++n) {
    whole.block(7 + 6 * n, 7 + 6 * n, 6, 6) = e.own[static_cast<size_t>(n)];
    whole.block(7 + 6 * n, 0, 6, 7) = e.between[static_cast<size_t>(n)];
    whole.block(0, 7 + 6 * n, 7, 6) = e.between[static_cast<size_t>(n)].transpose();
  }
  whole.diagonal() *= 1.1;
  std::vector<int> free;
  for (int p = 0; p < 19; ++p)
    if (!held[static_cast<size_t>(p)]) free.push_back(p);
  const Eigen::MatrixXd system = whole(free, free);
  const Eigen::VectorXd expected = system.ldlt().solve(Eigen::VectorXd(-e.gradient(free)));
  EXPECT_LT((step(free) - expected).norm(), 1e-8 * expected.norm());
  EXPECT_EQ(step[2], 0);
  EXPECT_EQ(step[9], 0);
}

TEST(PooledFit, RecoversTheTruthFromTwoRecordingsWithoutNoise) {
  FitProblem first = make_problem(synthetic_input(tiny(1)), {}, 5, 5);
  FitProblem second = make_problem(synthetic_input(tiny(2)), {}, 5, 5);
  make_exact(first, 1);
  make_exact(second, 2);
  const FitProblem* const problems[] = {&first, &second};
  std::map<std::string, double> start = truth();
  double off = 1.3;
  for (auto& [name, value] : start) {
    value *= off;
    off = 1 / off;
  }

  const PooledFit found = fit_pooled(problems, start, {}, {});

  ASSERT_TRUE(found.usable);
  EXPECT_TRUE(found.converged) << found.message << " after " << found.iterations;
  for (const auto& [name, value] : truth()) {
    SCOPED_TRACE(name);
    // The last round's time steps are those of values this near.
    EXPECT_NEAR(found.shared.at(name), value, 1e-4 * value);
  }
}

TEST(PooledFit, LiesBetweenTheFitsOfItsRecordingsAlone) {
  const FitProblem first = make_problem(synthetic_input(tiny(3)), {}, 5, 5);
  const FitProblem second = make_problem(synthetic_input(tiny(4)), {}, 5, 5);
  const FitProblem* const both[] = {&first, &second};

  const PooledFit pooled = fit_pooled(both, truth(), {}, {});
  const PooledFit one = fit_pooled(std::span(both).first(1), truth(), {}, {});
  const PooledFit other = fit_pooled(std::span(both).last(1), truth(), {}, {});

  ASSERT_TRUE(pooled.usable && one.usable && other.usable);
  // Together they cannot be explained better than each by itself.
  EXPECT_GT(pooled.cost, one.cost + other.cost);
  // The best determined parameter hardly trades against others, so it lies between the two.
  const auto [low, high] = std::minmax(one.shared.at("shear"), other.shared.at("shear"));
  EXPECT_GT(pooled.shared.at("shear"), low);
  EXPECT_LT(pooled.shared.at("shear"), high);
}

TEST(PooledFit, RefusesRecordingsOfDifferentPhysics) {
  const FitProblem plain = make_problem(synthetic_input(tiny(1)), {}, 5, 5);
  const FitProblem windy = make_problem(synthetic_input(tiny(1)), {.effects = {"wind"}}, 5, 5);
  const FitProblem* const problems[] = {&plain, &windy};
  const FitProblem* const turned[] = {&windy, &plain};

  EXPECT_THROW(fit_pooled(problems, {}, {}, {}), InputError);
  EXPECT_THROW(fit_pooled(turned, {}, {}, {}), InputError);
  EXPECT_THROW(fit_pooled({}, {}, {}, {}), InputError);
}

}  // namespace
}  // namespace clothfit
