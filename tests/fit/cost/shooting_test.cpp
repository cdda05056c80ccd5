// Checks the shooting cost and its fit. Steps and their derivatives are checked in tests/model, the
// elimination by itself in bordered_chain_test.cpp, guesses from tracks in track_states_test.cpp,
// whole fits that begin with shooting in fit_test.cpp.
#include "fit/cost/shooting.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>
#include <random>

#include "fit/jobs/stop_token.h"
#include "fit/problem/parameterised_model.h"
#include "fit/refine/refine.h"
#include "fit/refine/shooting_fit.h"
#include "model/cloth/stability.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

constexpr double kNoHuber = std::numeric_limits<double>::infinity();

SyntheticCloth tiny(unsigned seed, int frames = 20) {
  return {.mesh = 5, .markers = 5, .frames = frames, .held_out_from = frames, .seed = seed};
}

Eigen::VectorXd true_values_of(const FitProblem& problem) {
  return start_with(problem, SyntheticCloth{}.fabric);
}

/// A problem with windows that begin with the states of its own run at the truth. Its observations
/// are exactly that run.
struct ExactWindows {
  FitProblem problem;
  TimeSteps steps{0};
  ShootingWindows windows;
  Eigen::VectorXd truth;

  explicit ExactWindows(FitProblem of, int window_frames, int nodes) : problem(std::move(of)) {
    truth = true_values_of(problem);
    steps = stable_time_steps(problem.cloth, parameter_set(problem, truth)).times(1 / 1.5);
    ParameterSet set = parameter_set(problem, truth);
    if (problem.start == StartKind::at_rest)
      start_at_rest(problem.cloth, {&set, 1}, problem.gravity_m_per_s2.norm(),
                    problem.frame_time_s.front(), steps.rest_s);
    const SimulateResult run =
        simulate(
            problem.cloth, {&set, 1},
            {.frame_time_s = problem.frame_time_s, .time_step_s = steps.run_s, .velocities = true})
            .front();
    const auto markers = marker_positions(problem.vertex_weights, run.position_m);
    for (ObservationSet& observed : problem.observations)
      for (Observation& row : observed.rows)
        row.observed = *observed.predict(markers[static_cast<size_t>(row.frame)].col(row.marker));
    windows.nodes = nodes;
    for (int f = 0; f + 2 < problem.frames(); f += window_frames) {
      const auto frame = static_cast<size_t>(f);
      windows.first_frame.push_back(f);
      windows.position_m.push_back(f == 0 ? Eigen::Matrix3Xd() : run.position_m[frame]);
      windows.velocity_m_per_s.push_back(f == 0 ? Eigen::Matrix3Xd() : run.velocity_m_per_s[frame]);
    }
  }
  ShootingObjective objective(const Continuity& continuity) const {
    return {problem, problem.frames(), steps, windows, continuity};
  }
};

FitProblem shot_problem(unsigned seed) {
  return make_problem(synthetic_input(tiny(seed)), {}, 5, 5);
}

/// Makes a problem of a cloth let go at rest and seen by one camera whose vertical is uncertain.
FitProblem pixels_at_rest(unsigned seed) {
  FitInput input = synthetic_input(tiny(seed));
  input.recording.start = StartKind::at_rest;
  input.cameras[0].camera_from_world->covariance = Eigen::Matrix<double, 6, 6>::Identity() * 9e-6;
  return make_problem(input, {.observations = ObservationKind::tracks2d}, 5, 5);
}

/// Makes a problem in which one corner follows its noisy track, with corrections.
FitProblem driven_by_a_track(unsigned seed) {
  FitInput input = synthetic_input(tiny(seed));
  input.recording.held[1].motion = HeldMotion::tracked;
  return make_problem(input, {.drive_knots = 4}, 5, 5);
}

/// Returns corrections of some millimetres and centimetres a second.
ShootingObjective::Corrections some_corrections(const ShootingObjective& objective, unsigned seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  ShootingObjective::Corrections corrections = objective.no_corrections();
  for (Eigen::VectorXd& correction : corrections)
    for (Eigen::Index n = 0; n < correction.size(); ++n)
      correction[n] = (2 * n < correction.size() ? 2e-3 : 3e-2) * normal(generator);
  return corrections;
}

TEST(ShootingObjective, WithOneWindowIsTheTrajectoryCost) {
  for (const FitProblem& problem : {shot_problem(1), pixels_at_rest(1)}) {
    const Eigen::VectorXd values = true_values_of(problem);
    const TimeSteps steps =
        stable_time_steps(problem.cloth, parameter_set(problem, values)).times(1 / 1.5);
    const TrajectoryObjective trajectory(problem, 15, steps);
    const ShootingObjective one(
        problem, 15, steps,
        {.first_frame = {0}, .position_m = {{}}, .velocity_m_per_s = {{}}, .nodes = 3}, {1, 1});

    const Linearisation expected = trajectory.linearise(values), found = one.linearise(values);

    ASSERT_TRUE(expected.usable && found.usable);
    EXPECT_EQ(one.residuals({values}).front(), trajectory.residuals({values}).front());
    EXPECT_EQ(found.residual, expected.residual);
    EXPECT_EQ(found.residual_by_coordinate, expected.residual_by_coordinate);
    EXPECT_EQ(one.spring_steps_per_run(), trajectory.spring_steps_per_run());
  }
}

TEST(ShootingObjective, VanishesAtTheTruthWithTheTrueStates) {
  for (FitProblem problem : {shot_problem(1), pixels_at_rest(1), driven_by_a_track(1)}) {
    const ExactWindows exact(std::move(problem), 5, 5);
    const ShootingObjective objective = exact.objective({1e-3, 1e-2});

    // A window goes on from its given state as the run does, to rounding: 1e-15 m over the smallest
    // sigma, 5e-4 m, grows over 5 frames.
    EXPECT_LT(objective.residuals({exact.truth}).front().cwiseAbs().maxCoeff(), 1e-6);
    Eigen::VectorXd off = exact.truth;
    off[0] *= 1.01;
    EXPECT_GT(objective.residuals({off}).front().norm(), 1e-2);
  }
}

TEST(ShootingObjective, DerivativesByTheParametersAgreeWithDifferences) {
  for (FitProblem problem : {shot_problem(2), pixels_at_rest(2), driven_by_a_track(2)}) {
    const ExactWindows exact(std::move(problem), 5, 3);
    ShootingObjective objective = exact.objective({1e-3, 1e-2});
    objective.set_corrections(some_corrections(objective, 7));
    Eigen::VectorXd values = exact.truth;
    for (int p = 0; p < 7; ++p) values[p] *= p % 2 == 0 ? 1.1 : 0.95;

    const Linearisation tangents = objective.linearise(values);
    const Linearisation central = objective.linearise(values, Derivatives::central);

    ASSERT_TRUE(tangents.usable && central.usable);
    for (int p = 0; p < values.size(); ++p) {
      const auto column = tangents.residual_by_coordinate.col(p);
      // The differences' own error is of second order in a step of 1e-4.
      EXPECT_LT((column - central.residual_by_coordinate.col(p)).norm(), 1e-5 * column.norm())
          << exact.problem.space.parameters[static_cast<size_t>(p)].name;
    }
  }
}

/// Returns the cost with the priors, as a function of parameters' coordinates and corrections.
double whole_cost(const ShootingObjective& objective, const Eigen::VectorXd& coordinates,
                  const ShootingObjective::Corrections& corrections, double huber) {
  const Eigen::VectorXd values = objective.problem().space.values(coordinates);
  double cost = objective.cost(objective.residual(values, corrections), huber);
  for (const GaussianPrior& prior : objective.problem().priors)
    cost += 0.5 * prior.residual(values).squaredNorm();
  return cost;
}

TEST(ShootingObjective, HasTheGradientThatDifferencesOfTheCostShow) {
  // Given a start that is fitted along (released flat, or a tilt with its prior), off the optimum,
  // with the squared loss and with one that weighs most observations down
  for (FitProblem problem : {shot_problem(3), pixels_at_rest(3)}) {
    const ExactWindows exact(std::move(problem), 6, 3);
    ShootingObjective objective = exact.objective({2e-3, 2e-2});
    const ShootingObjective::Corrections corrections = some_corrections(objective, 5);
    objective.set_corrections(corrections);
    Eigen::VectorXd values = exact.truth;
    for (int p = 0; p < 7; ++p) values[p] *= 1.2;
    const Eigen::VectorXd x = exact.problem.space.coordinates(values);
    for (const double huber : {kNoHuber, 2.0}) {
      SCOPED_TRACE(huber);

      const ShootingObjective::Equations equations = objective.equations(values, huber);

      ASSERT_TRUE(equations.usable);
      EXPECT_NEAR(equations.cost, whole_cost(objective, x, corrections, huber),
                  1e-12 * equations.cost);
      // Truncation of the differences is of second order in their steps.
      const double scale = equations.chain.border_right.cwiseAbs().maxCoeff();
      for (Eigen::Index p = 0; p < x.size(); ++p) {
        const Eigen::VectorXd step = 1e-5 * Eigen::VectorXd::Unit(x.size(), p);
        const double difference = (whole_cost(objective, x + step, corrections, huber) -
                                   whole_cost(objective, x - step, corrections, huber)) /
                                  2e-5;
        EXPECT_NEAR(-equations.chain.border_right[p], difference, 1e-5 * scale) << p;
      }
      for (size_t w = 1; w < corrections.size(); ++w) {
        const Eigen::VectorXd& downhill = equations.chain.right[w];
        for (Eigen::Index n = 0; n < downhill.size(); n += 7) {
          ShootingObjective::Corrections above = corrections, below = corrections;
          above[w][n] += 1e-6;
          below[w][n] -= 1e-6;
          const double difference =
              (whole_cost(objective, x, above, huber) - whole_cost(objective, x, below, huber)) /
              2e-6;
          EXPECT_NEAR(-downhill[n], difference, 1e-5 * downhill.cwiseAbs().maxCoeff())
              << "window " << w << " number " << n;
        }
      }
    }
  }
}

TEST(ShootingObjective, HoldsFixedPointsWhereTheRecordingBeginsWithThem) {
  // Given guesses that lie two centimetres beside the cloth, held corners included
  ExactWindows exact(shot_problem(4), 5, 5);
  for (Eigen::Matrix3Xd& guess : exact.windows.position_m)
    if (guess.cols() > 0) guess.row(1).array() += 0.02;
  const ShootingObjective objective = exact.objective({1e-3, 1e-2});

  const std::optional<ShootingWindows> windows = objective.recentred(exact.truth);

  // Then each window still begins with its corners at their places.
  ASSERT_TRUE(windows);
  const Eigen::Matrix3Xd& start = parameter_set(exact.problem, exact.truth).start_position_m;
  for (size_t w = 1; w < windows->first_frame.size(); ++w)
    for (const int corner : {0, 4})
      // With as many nodes as vertices the guesses are the windows' own states.
      EXPECT_LT((windows->position_m[w].col(corner) - start.col(corner)).norm(), 1e-12);
}

TEST(ShootingFit, StepsAsTheDenseEquationsSay) {
  const ExactWindows exact(shot_problem(5), 6, 3);
  ShootingObjective objective = exact.objective({2e-3, 2e-2});
  objective.set_corrections(some_corrections(objective, 5));
  const ShootingObjective::Equations equations = objective.equations(exact.truth, kNoHuber);
  ASSERT_TRUE(equations.usable);
  const int parameters = exact.problem.space.size(), state = objective.state_size();
  const int states = objective.windows().count() - 1;
  std::vector<bool> held(static_cast<size_t>(parameters), false);
  held[2] = true;

  const BorderedChainSolution step = damped_step(equations.chain, 0.1, held);

  // The same follows from J'J of the derivatives by everything, by differences of residuals.
  const int all = parameters + states * state;
  Eigen::MatrixXd jacobian(objective.residual_count(), all);
  jacobian.leftCols(parameters) = objective.linearise(exact.truth).residual_by_coordinate;
  for (int w = 1; w <= states; ++w)
    for (int n = 0; n < state; ++n) {
      ShootingObjective::Corrections above = objective.corrections(), below = above;
      const double size = 2 * n < state ? 1e-5 : 1e-4;
      above[static_cast<size_t>(w)][n] += size;
      below[static_cast<size_t>(w)][n] -= size;
      jacobian.col(parameters + (w - 1) * state + n) =
          (objective.residual(exact.truth, above) - objective.residual(exact.truth, below)) /
          (2 * size);
    }
  Eigen::MatrixXd whole = jacobian.transpose() * jacobian;
  whole.diagonal() *= 1.1;
  std::vector<int> free;
  for (int n = 0; n < all; ++n)
    if (n != 2) free.push_back(n);
  const Eigen::VectorXd downhill = -jacobian.transpose() * equations.residual;
  const Eigen::MatrixXd system = whole(free, free);
  Eigen::VectorXd expected = Eigen::VectorXd::Zero(all);
  const Eigen::VectorXd solved = system.ldlt().solve(Eigen::VectorXd(downhill(free)));
  expected(free) = solved;
  Eigen::VectorXd found(all);
  found.head(parameters) = step.border;
  for (int w = 1; w <= states; ++w)
    found.segment(parameters + (w - 1) * state, state) = step.blocks[static_cast<size_t>(w)];
  // The differences err by about 1e-8 of a derivative. The equations are damped to a condition of
  // some thousands.
  EXPECT_LT((found - expected).norm(), 1e-4 * expected.norm());
  EXPECT_EQ(step.border[2], 0);
}

TEST(ShootingFit, ConvergesFromAfarWhereTheTrajectoryIsLost) {
  // Given two seconds of swinging, and every parameter off by a factor of five
  constexpr unsigned kSeed = 1;
  constexpr int kFrames = 120;
  const FitProblem problem = make_problem(synthetic_input(tiny(kSeed, kFrames)), {}, 5, 5);
  const Eigen::VectorXd truth = true_values_of(problem);
  Eigen::VectorXd start = truth;
  std::mt19937_64 generator(82);
  for (int p = 0; p < 7; ++p) start[p] *= (generator() & 1) != 0 ? 5 : 0.2;

  const RefineResult lost = refine(problem, kFrames, start, {.rounds = 3}, {});
  const ShootingFit led = fit_by_shooting(problem, kFrames, start, {}, {});
  ASSERT_TRUE(led.usable) << led.message;
  const RefineResult found = refine(problem, kFrames, led.values, {.trust_region_radius = 1e4}, {});

  SCOPED_TRACE("seed " + std::to_string(kSeed));
  EXPECT_GT(lost.cost, 5);  // half a squared sigma is the noise
  EXPECT_TRUE(found.converged) << found.message;
  EXPECT_LT(found.robust_scale, 1.1);
  for (int p = 0; p < 7; ++p) {
    SCOPED_TRACE(p);
    // A round's last gap of 1 mm and its three nodes leave this error open.
    EXPECT_NEAR(led.values[p] / truth[p], 1, 0.15);
    // The noise is half a millimetre over two seconds, and time steps are long.
    EXPECT_NEAR(found.values[p] / truth[p], 1, 0.02);
  }
}

TEST(ShootingFit, ConvergesFromPixelsToo) {
  // The windows' states are guessed from the run at the start, which is another motion by then.
  constexpr unsigned kSeed = 2;
  constexpr int kFrames = 60;
  const FitProblem problem = make_problem(synthetic_input(tiny(kSeed, kFrames)),
                                          {.observations = ObservationKind::tracks2d}, 5, 5);
  const Eigen::VectorXd truth = true_values_of(problem);
  Eigen::VectorXd start = truth;
  for (int p = 0; p < 7; ++p) start[p] *= p % 2 == 0 ? 5 : 0.2;

  const ShootingFit led = fit_by_shooting(problem, kFrames, start, {}, {});

  ASSERT_TRUE(led.usable) << led.message;
  for (int p = 0; p < 3; ++p)  // tension and shear; one camera tells less of the rest
    EXPECT_NEAR(led.values[p] / truth[p], 1, 0.15) << p;
}

/// Returns the Gauss-Newton step from `values` to the optimum of the trajectory's cost.
Eigen::VectorXd to_the_trajectorys_optimum(const FitProblem& problem, const ShootingFit& fit) {
  const TrajectoryObjective trajectory(
      problem, problem.frames(),
      time_steps_of_run(problem.cloth, parameter_set(problem, fit.values), fit.time_step_s));
  const Linearisation linear = trajectory.linearise(fit.values);
  const Eigen::MatrixXd& j = linear.residual_by_coordinate;
  return (j.transpose() * j).ldlt().solve(-j.transpose() * linear.residual);
}

TEST(ShootingFit, TendsToTheTrajectorysOptimumAsItsGapsClose) {
  // Given nodes as fine as the mesh, so that every gap is seen
  const FitProblem problem = shot_problem(6);
  ShootingOptions options{.window_frames = 6,
                          .nodes = 5,
                          .rounds = 1,
                          .iterations = 60,
                          .least_gain = 1e-12,
                          .loss = Loss::squared};
  std::vector<double> distance;
  for (const double gap_m : {1e-3, 1e-4, 1e-5, 1e-6}) {
    options.first_gap_m = options.last_gap_m = gap_m;
    const ShootingFit fit =
        fit_by_shooting(problem, problem.frames(), true_values_of(problem), options, {});
    ASSERT_TRUE(fit.usable) << fit.message;
    distance.push_back(to_the_trajectorys_optimum(problem, fit).norm());
  }
  // Gaps as wide as the observations' information on a state leave the windows their freedom. Once
  // they are narrower, the distance falls with the square of their sigma.
  EXPECT_GT(distance[0], 0.1);
  EXPECT_LT(distance[1], distance[0]);
  EXPECT_LT(distance[2], 0.03 * distance[1]);
  EXPECT_LT(distance[3], 0.015 * distance[2]);
}

TEST(ShootingFit, GivesTheSameBitsForAnyNumberOfThreads) {
  const FitProblem problem = shot_problem(7);
  ShootingOptions options{.window_frames = 5, .iterations = 3};
  std::vector<ShootingFit> fits;
  for (const size_t threads : {1, 4}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    fits.push_back(fit_by_shooting(problem, problem.frames(), problem.space.start(), options, {}));
  }

  ASSERT_TRUE(fits[0].usable && fits[1].usable);
  EXPECT_EQ(fits[0].values, fits[1].values);
  EXPECT_EQ(fits[0].cost, fits[1].cost);
  EXPECT_EQ(fits[0].corrections, fits[1].corrections);
}

TEST(ShootingFit, EndsSoonWhenItIsCancelled) {
  const FitProblem problem = shot_problem(4);
  int calls = 0;

  EXPECT_THROW(fit_by_shooting(problem, problem.frames(), problem.space.start(), {},
                               [&](const Progress&) { return ++calls < 2; }),
               StopRequested);

  EXPECT_EQ(calls, 2);
}

}  // namespace
}  // namespace clothfit
