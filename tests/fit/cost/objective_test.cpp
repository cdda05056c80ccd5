// Checks residuals of the trajectory cost and their derivatives. A step of the model is checked in
// tests/model; the search for the minimum in refine_test.cpp.
#include "fit/cost/objective.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fit/problem/parameterised_model.h"
#include "model/cloth/stability.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

FitProblem small_problem(ObservationKind kind, double noise_m = 1e-9) {
  return make_problem(synthetic_input({.noise_m = noise_m, .noise_px = 0.3}),
                      {.observations = kind, .effects = {"viscous_damping"}}, 9, 9);
}

Eigen::VectorXd true_values(const FitProblem& problem) {
  Eigen::VectorXd values = start_with(problem, SyntheticCloth{}.fabric);
  values[problem.space.index("viscous_damping.rate")] = 0;
  return values;
}

TEST(Objective, VanishesAtTheTruthWhenTheStepIsTheSame) {
  const FitProblem problem = small_problem(ObservationKind::tracks3d);
  const TrajectoryObjective objective(problem, problem.frames(), 1.0 / 60 / 200);

  const Eigen::VectorXd residual = objective.residuals({true_values(problem)}).front();

  ASSERT_EQ(residual.size(), objective.residual_count());
  EXPECT_EQ(residual.size(), 3 * 49 * 36);
  // Sigma is 1e-9 m and so is the noise; the sheet placed on it is off by as little.
  EXPECT_NEAR(std::sqrt(residual.squaredNorm() / static_cast<double>(residual.size())), 1.0, 0.1);
}

TEST(Objective, LooksAtTheFirstFramesOnly) {
  const FitProblem problem = small_problem(ObservationKind::tracks3d);

  const TrajectoryObjective objective(problem, 5, 1.0 / 60 / 200);

  EXPECT_EQ(objective.residual_count(), 3 * 49 * 5);
  for (const Objective::Block& block : objective.blocks())
    EXPECT_LT(problem.observations[0].rows[static_cast<size_t>(block.row)].frame, 5);
}

/// Takes another route to derivatives: central differences, error O(step^2).
Eigen::VectorXd difference(const Objective& objective, const Eigen::VectorXd& values, int p,
                           double step) {
  const ParameterSpace& space = objective.problem().space;
  Eigen::VectorXd plus = space.coordinates(values), minus = plus;
  plus[p] += step;
  minus[p] -= step;
  const auto r = objective.residuals({space.values(plus), space.values(minus)});
  return (r[0] - r[1]) / (2 * step);
}

/// Extrapolates from two large steps; error O(step^4).
Eigen::VectorXd richardson(const Objective& objective, const Eigen::VectorXd& values, int p,
                           double step) {
  return (4 * difference(objective, values, p, step) - difference(objective, values, p, 2 * step)) /
         3;
}

TEST(Objective, DerivativesAgreeWithRichardsonExtrapolation) {
  for (const ObservationKind kind : {ObservationKind::tracks3d, ObservationKind::tracks2d}) {
    SCOPED_TRACE(kind == ObservationKind::tracks3d ? "3D" : "2D");
    FitInput input = synthetic_input({.noise_m = 5e-4, .noise_px = 0.3});
    input.cameras[0].camera_from_world->covariance = Eigen::Matrix<double, 6, 6>::Identity() * 9e-6;
    const FitProblem problem =
        make_problem(input, {.observations = kind, .effects = {"viscous_damping"}}, 9, 9);
    const TrajectoryObjective objective(problem, 20, 1.0 / 60 / 150);
    Eigen::VectorXd values = true_values(problem);
    for (int p = 8; p < problem.space.size(); ++p) values[p] += 2e-3;  // tilt and sheet

    const Linearisation exact = objective.linearise(values);
    const Linearisation central = objective.linearise(values, Derivatives::central);
    const Linearisation forward = objective.linearise(values, Derivatives::forward);

    ASSERT_TRUE(exact.usable && central.usable && forward.usable);
    EXPECT_EQ(central.runs, 1 + 2 * problem.space.size());
    EXPECT_EQ(exact.residual, objective.residuals({values}).front());
    EXPECT_EQ(central.residual, exact.residual);
    EXPECT_EQ(forward.residual, exact.residual);
    for (int p = 0; p < problem.space.size(); ++p) {
      SCOPED_TRACE(problem.space.parameters[static_cast<size_t>(p)].name);
      const Eigen::VectorXd reference = richardson(objective, values, p, 2e-3);
      const auto error = [&](const Linearisation& linear) {
        return (linear.residual_by_coordinate.col(p) - reference).norm() / reference.norm();
      };
      EXPECT_LT(error(exact), 1e-5);
      EXPECT_LT(error(central), 1e-5);
      EXPECT_LT(error(forward), 1e-2);
      EXPECT_GT(reference.norm(), 0);
    }
  }
}

TEST(Objective, DerivativesHoldForAStartAtRestAndForThePapersSets) {
  for (const SpringSet set : {SpringSet::fabric, SpringSet::louchet5, SpringSet::louchet18}) {
    SCOPED_TRACE(to_string(set));
    FitProblem problem = make_problem(synthetic_input({.noise_m = 5e-4}),
                                      {.spring_set = set, .effects = {"viscous_damping"}}, 5, 5);
    problem.start = StartKind::at_rest;
    Eigen::VectorXd values = problem.space.start();
    if (set == SpringSet::fabric) {
      values = true_values(problem);
    } else {  // all springs alike, limits that most of them reach
      for (int p = 0; p < problem.space.size(); ++p) {
        const std::string& name = problem.space.parameters[static_cast<size_t>(p)].name;
        if (name.starts_with("stiffness")) values[p] = 20;
        if (name.starts_with("critical")) values[p] = 0.04;
      }
    }
    const TrajectoryObjective objective(problem, 6, 1.0 / 60 / 150);

    const Linearisation exact = objective.linearise(values);

    ASSERT_TRUE(exact.usable);
    EXPECT_EQ(exact.residual, objective.residuals({values}).front());
    for (int p = 0; p < problem.space.size(); ++p) {
      SCOPED_TRACE(problem.space.parameters[static_cast<size_t>(p)].name);
      // Where the limit acts, a wide difference would cross from one set of limited springs into
      // another. A narrow one leaves nothing to extrapolate.
      const Eigen::VectorXd reference = set == SpringSet::fabric
                                            ? richardson(objective, values, p, 1e-3)
                                            : difference(objective, values, p, 1e-6);
      EXPECT_LT((exact.residual_by_coordinate.col(p) - reference).norm(),
                1e-4 * reference.norm() + 1e-6 * exact.residual.norm());
    }
  }
}

TEST(Objective, SaysNothingWhereTheStepWouldNotBeStable) {
  const FitProblem problem = small_problem(ObservationKind::tracks3d);
  const Eigen::VectorXd good = true_values(problem);
  const double stable_s = stable_time_step_s(problem.cloth, parameter_set(problem, good));
  const TrajectoryObjective objective(problem, 10, 0.9 * stable_s);
  Eigen::VectorXd stiff = good;
  stiff[problem.space.index("tension_warp")] *= 20;

  const auto residuals = objective.residuals({stiff, good, stiff});

  EXPECT_EQ(residuals[0].size(), 0);
  EXPECT_EQ(residuals[1].size(), objective.residual_count());
  EXPECT_EQ(objective.mean_length(residuals[0]), INFINITY);
  EXPECT_TRUE(std::isfinite(objective.mean_length(residuals[1])));
  const Linearisation linear = objective.linearise(stiff, Derivatives::forward);
  EXPECT_FALSE(linear.usable);
  EXPECT_EQ(linear.runs, 0);
}

TEST(Objective, DoesNotDependOnWhatElseIsEvaluated) {
  const FitProblem problem = small_problem(ObservationKind::tracks2d);
  const TrajectoryObjective objective(problem, 12, 1.0 / 60 / 150);
  const Eigen::VectorXd values = true_values(problem);
  Eigen::VectorXd other = values;
  other[0] *= 1.3;

  const Eigen::VectorXd alone = objective.residuals({values}).front();
  const auto among = objective.residuals(
      {other, other, values, other, other, other, other, other, other, other, values});

  EXPECT_EQ(alone, among[2]);
  EXPECT_EQ(alone, among[10]);
}

}  // namespace
}  // namespace clothfit
