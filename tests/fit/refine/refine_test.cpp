// Least squares over a trajectory, and how sure its result is. The residuals and their derivatives
// are checked in objective_test.cpp, the whole fit from nothing in fit_test.cpp.
#include "fit/refine/refine.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "fit/jobs/stop_token.h"
#include "fit/uncertainty/uncertainty.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

/// A 5 x 5 cloth over 20 frames: a fit of it takes a fraction of a second.
SyntheticCloth tiny_swing(unsigned seed) {
  return {
      .mesh = 5, .markers = 5, .frames = 20, .held_out_from = 20, .noise_m = 5e-4, .seed = seed};
}

FitProblem tiny_problem(unsigned seed, const FitOptions& options = {}) {
  return make_problem(synthetic_input(tiny_swing(seed)), options, 5, 5);
}

Eigen::VectorXd truth_of(const FitProblem& problem) {
  return start_with(problem, SyntheticCloth{}.fabric);
}

TEST(Refine, FindsTheTruthFromAStartThatIsOffByAFactor) {
  const FitProblem problem = tiny_problem(1);
  const Eigen::VectorXd truth = truth_of(problem);
  Eigen::VectorXd start = truth;
  for (int p = 0; p < 7; ++p) start[p] *= p % 2 == 0 ? 1.6 : 0.65;

  const RefineResult result = refine(problem, problem.frames(), start, {}, {});

  ASSERT_TRUE(result.usable) << result.message;
  EXPECT_TRUE(result.converged);
  const TrajectoryObjective objective(problem, problem.frames(), result.time_step_s);
  const Uncertainty uncertainty = estimate_uncertainty(objective, result.values);
  ASSERT_TRUE(uncertainty.usable);
  for (int p = 0; p < 7; ++p) {
    SCOPED_TRACE(problem.space.parameters[static_cast<size_t>(p)].name);
    EXPECT_LT(std::abs(result.values[p] - truth[p]), 4 * uncertainty.sigma[p]);
    EXPECT_NEAR(uncertainty.roughness[p], 1.0, 0.2);  // nothing chaotic in a third of a second
  }
  // Noise alone is left: 1500 residuals, whose mean square scatters by 4 %
  EXPECT_NEAR(uncertainty.chi_square_per_dof, 1.0, 0.15);
}

TEST(Refine, FindsTheBestOfTheOthersWhenOneEndsAtItsBound) {
  // Given a range that ends well below the true stiffness,
  FitProblem problem = tiny_problem(1);
  const Eigen::VectorXd truth = truth_of(problem);
  FitParameter& tension = problem.space.parameters.front();
  tension.upper = 0.7 * truth[0];
  Eigen::VectorXd start = truth;
  start[0] = 0.5 * truth[0];
  for (int p = 1; p < 7; ++p) start[p] *= p % 2 == 0 ? 1.4 : 0.7;

  const RefineResult result = refine(problem, problem.frames(), start, {}, {});

  ASSERT_TRUE(result.usable) << result.message;
  EXPECT_TRUE(result.converged) << result.message;
  EXPECT_NEAR(result.values[0], tension.upper, 1e-9 * tension.upper);
  // then the others are where they end with that one known and none at a bound.
  tension.lower = tension.upper * (1 - 1e-9);
  start[0] = tension.upper;
  const RefineResult given = refine(problem, problem.frames(), start, {}, {});
  ASSERT_TRUE(given.converged) << given.message;
  EXPECT_NEAR(result.cost, given.cost, 1e-3 * given.cost);  // their time steps differ
  const TrajectoryObjective objective(problem, problem.frames(), result.time_step_s);
  const Uncertainty uncertainty = estimate_uncertainty(objective, given.values);
  for (int p = 1; p < 7; ++p)
    EXPECT_NEAR(result.values[p], given.values[p], 0.05 * uncertainty.sigma[p]) << p;
}

TEST(Refine, EndsAtTheLimitOfWorkWithWhatItHasReached) {
  const FitProblem problem = tiny_problem(1);
  Eigen::VectorXd start = truth_of(problem);
  for (int p = 0; p < 7; ++p) start[p] *= p % 2 == 0 ? 1.6 : 0.65;
  const RefineResult whole = refine(problem, problem.frames(), start, {}, {});
  ASSERT_GT(whole.solver_iterations, 3);
  const double run =
      TrajectoryObjective(problem, problem.frames(), whole.time_step_s).spring_steps_per_run();
  const double first_two_points = 1.5 * (1 + 2 * problem.space.size()) * run;

  const RefineResult cut =
      refine(problem, problem.frames(), start, {.most_spring_steps = first_two_points}, {});

  EXPECT_TRUE(cut.usable);
  EXPECT_FALSE(cut.converged);
  EXPECT_EQ(cut.message, "not converged at the limit of work");
  EXPECT_LT(cut.simulations, whole.simulations);
  EXPECT_GT(cut.cost, whole.cost);
}

TEST(Refine, ScatterOverNoiseIsWhatTheCovariancePredicts) {
  constexpr int kTrials = 20;
  Eigen::ArrayXd squared_pull = Eigen::ArrayXd::Zero(7);
  for (unsigned trial = 0; trial < kTrials; ++trial) {
    SCOPED_TRACE(trial);
    const FitProblem problem = tiny_problem(100 + trial);
    const Eigen::VectorXd truth = truth_of(problem);

    const RefineResult result =
        refine(problem, problem.frames(), truth, {.least_gain = 1e-5, .substep_scale = 6}, {});

    ASSERT_TRUE(result.usable) << result.message;
    const TrajectoryObjective objective(problem, problem.frames(), result.time_step_s);
    const Uncertainty uncertainty = estimate_uncertainty(objective, result.values);
    squared_pull +=
        ((result.values - truth).array() / uncertainty.sigma.array()).head<7>().square() / kTrials;
  }
  // Mean squared pull 1; of 20 it scatters by sqrt(2 / 20) = 0.32. The larger of two variance
  // estimates is taken, which lowers it somewhat. Small steps, as the truth's: what a long one does
  // is the next test.
  for (int p = 0; p < 7; ++p) {
    SCOPED_TRACE(p);
    EXPECT_GT(squared_pull[p], 0.3);
    EXPECT_LT(squared_pull[p], 2.0);
  }
}

TEST(Uncertainty, ForeseesWhatALongTimeStepDoesToTheParameters) {
  // Given the same noisy tracks fitted with long steps and with steps a tenth as long
  const FitProblem problem = tiny_problem(8);
  const Eigen::VectorXd truth = truth_of(problem);
  const RefineResult rough = refine(problem, problem.frames(), truth, {}, {});
  const RefineResult fine = refine(problem, problem.frames(), truth, {.substep_scale = 10}, {});
  ASSERT_TRUE(rough.usable && fine.usable);

  const TrajectoryObjective objective(problem, problem.frames(), rough.time_step_s);
  const Uncertainty uncertainty = estimate_uncertainty(objective, rough.values);

  // Then the shift is predicted: to first order in the step, and 9/10 of it was taken away
  ASSERT_TRUE(uncertainty.usable);
  const Eigen::VectorXd predicted = 0.9 * uncertainty.step_shift;
  const Eigen::VectorXd seen = fine.values - rough.values;
  for (const char* name : {"tension_warp", "tension_weft", "damping_warp"}) {
    SCOPED_TRACE(name);
    const int p = problem.space.index(name);
    EXPECT_NEAR(seen[p], predicted[p], 0.25 * std::abs(predicted[p]) + 0.1 * uncertainty.sigma[p]);
  }
}

TEST(Refine, GrossOutliersHardlyPull) {
  FitInput input = synthetic_input(tiny_swing(2));
  std::mt19937_64 generator(9);
  std::uniform_real_distribution<double> uniform(-0.1, 0.1);
  for (size_t n = 40; n < input.tracks3d.size(); n += 20)  // 5 %, up to 10 cm off; not in frame 0
    for (double& coordinate : input.tracks3d[n].position_m) coordinate += uniform(generator);
  const FitProblem problem = make_problem(input, {}, 5, 5);
  const Eigen::VectorXd truth = truth_of(problem);

  const RefineResult result = refine(problem, problem.frames(), truth, {}, {});

  ASSERT_TRUE(result.usable) << result.message;
  for (int p = 0; p < 3; ++p)  // tension and shear, which are known to a percent without outliers
    EXPECT_NEAR(result.values[p] / truth[p], 1.0, 0.1);
}

TEST(Refine, PriorHoldsWhatTheDataLeaveOpen) {
  // Given pixels of a camera whose pose is uncertain, and a start with gravity turned by 5 mrad
  FitInput input = synthetic_input(tiny_swing(3));
  input.cameras[0].camera_from_world->covariance = Eigen::Matrix<double, 6, 6>::Identity() * 9e-6;
  const FitProblem problem = make_problem(input, {.observations = ObservationKind::tracks2d}, 5, 5);
  const int tilt_a = problem.space.index("world_tilt_a");
  const int tilt_b = problem.space.index("world_tilt_b");
  Eigen::VectorXd start = truth_of(problem);
  start[tilt_a] = start[tilt_b] = 5e-3;

  const RefineResult result = refine(problem, problem.frames(), start, {}, {});

  // Then the data and the prior bring it back: it truly points down
  ASSERT_TRUE(result.usable) << result.message;
  const TrajectoryObjective objective(problem, problem.frames(), result.time_step_s);
  const Uncertainty uncertainty = estimate_uncertainty(objective, result.values);
  for (const int p : {tilt_a, tilt_b}) {
    EXPECT_LT(std::abs(result.values[p]), 4 * uncertainty.sigma[p]);
    EXPECT_LE(uncertainty.sigma[p], 3e-3 * 1.0001);
  }
}

TEST(Refine, EndsSoonWhenItIsCancelled) {
  const FitProblem problem = tiny_problem(4);
  int calls = 0;

  EXPECT_THROW(refine(problem, problem.frames(), problem.space.start(), {},
                      [&](const Progress&) { return ++calls < 2; }),
               StopRequested);

  EXPECT_EQ(calls, 2);
}

TEST(Uncertainty, SaysSoWhenTheDataHoldNothingAboutAParameter) {
  // Given two frames: the cloth has hardly begun to fall
  const FitProblem problem = tiny_problem(5);
  const TrajectoryObjective objective(problem, 2, 1.0 / 60 / 100);

  const Uncertainty uncertainty = estimate_uncertainty(objective, truth_of(problem));

  ASSERT_TRUE(uncertainty.usable);
  const int flexion = problem.space.index("flexion_warp");
  EXPECT_GT(uncertainty.sigma[flexion], truth_of(problem)[flexion]);
}

}  // namespace
}  // namespace clothfit
