// Checks corrections of the smoothed tracks of held points. The smoothing itself is checked in
// smoothing_spline_test.cpp, how shifts of held points move the cloth in
// tests/model/held_shift_test.cpp, shooting in shooting_test.cpp, model files in
// simulation_test.cpp.
#include "fit/problem/drive_correction.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "data/input_error.h"
#include "fit/cost/state_objective.h"
#include "fit/problem/parameterised_model.h"
#include "fit/problem/prior_cost.h"
#include "fit/refine/refine.h"
#include "fit/uncertainty/uncertainty.h"
#include "model/integrate/simulate.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr double kJitter = 1e-12;  // m^2: the micrometre that path_covariance() adds

// --- the prior -----------------------------------------------------------------------------------

/// Makes a smoothed track with uneven times, of samples that are not all as good.
TrackedPoint uneven_track(unsigned seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  std::vector<double> time_s;
  TrackedPoint point;
  Eigen::MatrixXd samples(3, 14);
  for (int n = 0; n < 14; ++n) {
    time_s.push_back(0.05 * n + (n > 6 ? 0.11 : 0) + 0.01 * std::sin(3.0 * n));
    point.sigma.push_back(2e-3 + 1e-3 * std::cos(2.0 * n));
    for (int c = 0; c < 3; ++c)
      samples(c, n) =
          0.05 * std::sin(4 * time_s.back() + c) + point.sigma.back() * normal(generator);
  }
  point.path = std::make_shared<const SmoothingSpline>(
      fit_smoothing_spline(time_s, samples, point.sigma, {.smoothing = 0.3, .robust = false}));
  return point;
}

/// Returns the covariance of a path after the samples, by dense matrices. Its second derivative is
/// white noise of density 1 / lambda, and nothing else is known of it: kriging with lines of
/// unknown coefficients.
Eigen::MatrixXd dense_covariance(const TrackedPoint& point, const std::vector<double>& time_s) {
  const SmoothingSpline& path = *point.path;
  const double origin_s = std::min(path.time_s.front(), time_s.front());
  const auto kernel = [&](const std::vector<double>& rows, const std::vector<double>& columns) {
    Eigen::MatrixXd k(rows.size(), columns.size());
    for (size_t i = 0; i < rows.size(); ++i)
      for (size_t j = 0; j < columns.size(); ++j) {
        const double less = std::min(rows[i], columns[j]) - origin_s;
        const double more = std::max(rows[i], columns[j]) - origin_s;
        k(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
            less * less * (3 * more - less) / (6 * path.smoothing);
      }
    return k;
  };
  const auto lines = [&](const std::vector<double>& times) {
    Eigen::MatrixXd t(times.size(), 2);
    for (size_t i = 0; i < times.size(); ++i)
      t.row(static_cast<Eigen::Index>(i)) << 1, times[i] - origin_s;
    return t;
  };
  Eigen::MatrixXd observed = kernel(path.time_s, path.time_s);
  for (size_t n = 0; n < point.sigma.size(); ++n)
    observed(static_cast<Eigen::Index>(n), static_cast<Eigen::Index>(n)) +=
        point.sigma[n] * point.sigma[n];
  const Eigen::LDLT<Eigen::MatrixXd> factors(observed);
  const Eigen::MatrixXd across = kernel(time_s, path.time_s), t = lines(path.time_s);
  const Eigen::MatrixXd left = lines(time_s) - across * factors.solve(t);
  const Eigen::MatrixXd information = t.transpose() * factors.solve(t);
  return path.noise_sigma * path.noise_sigma *
         (kernel(time_s, time_s) - across * factors.solve(across.transpose()) +
          left * information.inverse() * left.transpose());
}

TEST(PathCovariance, IsThatOfAPathBentByWhiteNoiseAfterItsSamples) {
  const TrackedPoint point = uneven_track(1);
  // Times are those of samples, between them, in a gap, before the first and behind the last.
  const std::vector<double>& sample_s = point.path->time_s;
  const std::vector<double> time_s{-0.04, sample_s[1], 0.5 * (sample_s[3] + sample_s[4]),
                                   0.4,   sample_s[9], 0.9};
  ASSERT_LT(sample_s.back(), 0.9);

  Eigen::MatrixXd covariance = path_covariance(point, time_s, "test");
  covariance.diagonal().array() -= kJitter;

  const Eigen::MatrixXd expected = dense_covariance(point, time_s);
  // The dense equations lose about seven digits, in which paths of a kilometre cancel.
  EXPECT_LT((covariance - expected).norm(), 1e-7 * expected.norm());
  EXPECT_EQ(covariance, Eigen::MatrixXd(covariance.transpose()));
  // The gap is known less well than the samples' times.
  EXPECT_GT(covariance(3, 3), 1.5 * covariance(1, 1));
}

TEST(PathCovariance, SumsToTheDegreesOfFreedomOverTheSamples) {
  std::mt19937_64 generator(2);
  std::normal_distribution<double> normal;
  std::vector<double> time_s;
  Eigen::MatrixXd samples(3, 40);
  for (int n = 0; n < 40; ++n) {
    time_s.push_back(n / 60.0);
    for (int c = 0; c < 3; ++c)
      samples(c, n) = 0.1 * std::sin(9 * time_s.back() + c) + 3e-3 * normal(generator);
  }
  TrackedPoint point;
  point.path = std::make_shared<const SmoothingSpline>(fit_smoothing_spline(time_s, samples));

  const Eigen::MatrixXd covariance = path_covariance(point, time_s, "test");

  const double noise = point.path->noise_sigma;
  const double freedom = point.path->degrees_of_freedom;
  EXPECT_NEAR((covariance.trace() - 40 * kJitter) / (noise * noise), freedom, 1e-8 * freedom);
  for (int n = 0; n < 40; ++n)
    EXPECT_NEAR(covariance(n, n) - kJitter,
                std::pow(point.path->value_sigma[static_cast<size_t>(n)], 2),
                1e-8 * covariance(n, n));
}

TEST(PathCovariance, CanBeInvertedWithMoreTimesThanThePathHasFreedomAndWithoutNoise) {
  const TrackedPoint point = uneven_track(3);
  std::vector<double> time_s;
  for (int k = 0; k < 200; ++k) time_s.push_back(0.004 * k);
  TrackedPoint still;
  still.path = std::make_shared<const SmoothingSpline>(fit_smoothing_spline(
      {0, 0.1, 0.2, 0.3}, Eigen::MatrixXd::Constant(3, 4, 0.2), {}, {.robust = false}));

  for (const TrackedPoint* of : {&point, static_cast<const TrackedPoint*>(&still)}) {
    const Eigen::MatrixXd covariance = path_covariance(*of, time_s, "test");

    EXPECT_EQ(Eigen::LLT<Eigen::MatrixXd>(covariance).info(), Eigen::Success);
    EXPECT_GE(covariance.diagonal().minCoeff(), kJitter);
  }
}

TEST(PathCovariance, RefusesATrackThatSaysNothingOfItsNoise) {
  TrackedPoint point;
  point.path = std::make_shared<const SmoothingSpline>(
      fit_smoothing_spline({0, 1}, Eigen::MatrixXd::Identity(3, 2)));

  EXPECT_THAT(
      [&] { path_covariance(point, {0.5}, "FitOptions::drive_knots"); },
      ThrowsMessage<InputError>(HasSubstr("FitOptions::drive_knots: a tracked held point")));
}

// --- the path ------------------------------------------------------------------------------------

/// Makes the synthetic cloth, both corners held where noisy tracks have them.
FitInput tracked_corners() {
  FitInput input = synthetic_input({.mesh = 5, .markers = 5});
  for (HeldPoint& held : input.recording.held) held.motion = HeldMotion::tracked;
  return input;
}

Eigen::VectorXd some_values(const FitProblem& problem) {
  Eigen::VectorXd values = problem.space.start();
  for (int p = 0; p < problem.space.size(); ++p)
    if (problem.space.parameters[static_cast<size_t>(p)].role == ParameterRole::drive)
      values[p] = 1e-3 * std::cos(3.0 * p);
  return values;
}

TEST(DriveCorrection, GoesThroughItsKnotsAndSmoothlyToZeroBehindThem) {
  const FitProblem problem = make_problem(tracked_corners(), {.drive_knots = 6}, 5, 5);
  const Eigen::VectorXd values = some_values(problem);
  const DriveCorrection& correction = problem.drive_correction;
  ASSERT_EQ(correction.points.size(), 2u);

  const auto shift = parameter_set(problem, values).held_shift[1];

  const double last_s = problem.frame_time_s[25], spacing_s = last_s / 5;
  for (int k = 0; k < 6; ++k)
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_NEAR(shift(k * spacing_s)[axis],
                  correction.points[1].values[static_cast<size_t>(3 * k + axis)].value(values),
                  1e-15);
  EXPECT_EQ(shift(last_s + spacing_s), Eigen::Vector3d::Zero());
  EXPECT_EQ(shift(last_s + 3 * spacing_s), Eigen::Vector3d::Zero());
  // Its second derivative does not jump. Differences of a step h beside a knot differ by the third
  // derivative's share alone, which shrinks with h.
  const auto jump = [&](double at_s, double h) {
    const auto second = [&](double t) -> Eigen::Vector3d {
      return (shift(t - h) - 2 * shift(t) + shift(t + h)) / (h * h);
    };
    return (second(at_s + h) - second(at_s - h)).norm();
  };
  for (int k = 1; k <= 8; ++k) {
    const double at_s = std::min(k, 5) * spacing_s + std::max(k - 5, 0) * spacing_s / 3;
    SCOPED_TRACE(at_s);
    EXPECT_GT(jump(at_s, 1e-2), 0);
    EXPECT_NEAR(jump(at_s, 1e-3) / jump(at_s, 1e-2), 0.1, 0.02);
  }
}

TEST(DriveCorrection, IsTheSumOfWhatItsValuesDo) {
  const FitProblem problem = make_problem(tracked_corners(), {.drive_knots = 5}, 5, 5);
  const Eigen::VectorXd values = some_values(problem);
  const DriveCorrection& correction = problem.drive_correction;

  const auto shifts = drive_shifts(correction, values, 2);

  for (double t = -0.05; t < 0.7; t += 0.013) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int n = 0; n < 15; ++n)
      sum +=
          drive_shift_by_value(correction, n / 3,
                               correction.points[0].values[static_cast<size_t>(n)].value(values) *
                                   Eigen::Vector3d::Unit(n % 3))(t);
    EXPECT_LT((sum - shifts[0](t)).norm(), 1e-17);
  }
}

TEST(DriveCorrection, IsTheSameOnEveryMesh) {
  FitInput input = tracked_corners();
  // An edge holds as many vertices as the mesh has there.
  input.recording.held.insert(input.recording.held.begin(), {.edge = ClothEdge::bottom});
  const FitProblem coarse = make_problem(input, {.drive_knots = 5}, 5, 5);
  const FitProblem fine = make_problem(input, {.drive_knots = 5}, 9, 9);
  const Eigen::VectorXd values = some_values(fine);
  ASSERT_EQ(coarse.space.size(), fine.space.size());

  const auto on_coarse = parameter_set(coarse, values).held_shift;
  const auto on_fine = parameter_set(fine, values).held_shift;

  ASSERT_EQ(on_coarse.size(), 7u);
  ASSERT_EQ(on_fine.size(), 11u);
  for (double t = 0; t < 0.7; t += 0.013)
    for (size_t h = 0; h < 2; ++h) EXPECT_EQ(on_coarse[5 + h](t), on_fine[9 + h](t));
  EXPECT_EQ(prior_cost(coarse, values).cost, prior_cost(fine, values).cost);
}

// --- the fit -------------------------------------------------------------------------------------

TEST(DriveCorrection, HasDerivativesThatAgreeWithDifferences) {
  for (const StartKind start : {StartKind::released_flat, StartKind::at_rest}) {
    SCOPED_TRACE(start == StartKind::at_rest ? "at rest" : "released");
    FitInput input = tracked_corners();
    input.recording.start = start;
    const FitProblem problem = make_problem(input, {.drive_knots = 4}, 5, 5);
    // The frames reach into the held-out ones, where corrections go to zero.
    const TrajectoryObjective objective(problem, 32, 1.0 / 60 / 100);
    const Eigen::VectorXd values = some_values(problem);

    const Linearisation exact = objective.linearise(values);
    const Linearisation central = objective.linearise(values, Derivatives::central);

    ASSERT_TRUE(exact.usable && central.usable);
    EXPECT_EQ(exact.residual, objective.residuals({values}).front());
    for (int p = 0; p < problem.space.size(); ++p) {
      const FitParameter& parameter = problem.space.parameters[static_cast<size_t>(p)];
      if (parameter.role != ParameterRole::drive) continue;
      SCOPED_TRACE(parameter.name);
      const auto column = exact.residual_by_coordinate.col(p);
      EXPECT_GT(column.norm(), 1e-2);
      // The tolerance is that of objective_test.cpp.
      EXPECT_LT((column - central.residual_by_coordinate.col(p)).norm(), 1e-5 * column.norm());
    }
  }
}

TEST(DriveCorrection, NeedsATrackedPointAndSomeKnots) {
  const FitInput fixed = synthetic_input({.mesh = 5, .markers = 5});
  EXPECT_THAT([&] { make_problem(fixed, {.drive_knots = 6}, 5, 5); },
              ThrowsMessage<InputError>(HasSubstr("FitOptions::drive_knots: no held point")));
  EXPECT_THAT(
      [] { FitOptions{.drive_knots = 3}.validate(); },
      ThrowsMessage<InputError>(HasSubstr("FitOptions::drive_knots: is out of range; 4 to")));
  FitOptions forecast{.drive_knots = 6};
  EXPECT_NO_THROW(forecast.validate());
  forecast.forecast = FitResult();
  EXPECT_THAT([&] { forecast.validate(); },
              ThrowsMessage<InputError>(HasSubstr("FitOptions::drive_knots")));
  EXPECT_TRUE(make_problem(tracked_corners(), {}, 5, 5).drive_correction.points.empty());
}

constexpr double kTruthStep = 1.0 / 60 / 60;  ///< s; fits take the same, so that it biases nothing
constexpr int kTruthFrames = 60;

/// Makes a cloth of 0.4 m let go 10 degrees out of the vertical while its corners are moved by some
/// centimetres. Markers are measured to a millimetre, the corners to three.
FitInput driven_input(unsigned seed) {
  constexpr double kSize = 0.4, kNoise = 1e-3, kDriveNoise = 3e-3;
  FitInput input = synthetic_input({.mesh = 5, .markers = 5, .frames = 2, .held_out_from = 2});
  input.recording.held_out_from_frame = kTruthFrames;
  for (HeldPoint& held : input.recording.held) held.motion = HeldMotion::tracked;

  const Mesh mesh{5, 5, kSize, kSize};
  Cloth cloth = Cloth::of(mesh, masses_by_area(mesh, input.recording.cloth.mass_kg.value()));
  cloth.held = {held_at(mesh, 0, 0), held_at(mesh, kSize, 0)};
  const auto wave = [](double hertz, double time_s) {
    return 1 - std::cos(2 * std::numbers::pi * hertz * time_s);
  };
  cloth.held[0].motion = [wave](double t) {
    return Eigen::Vector3d(0.01 * wave(2, t), 0.04 * wave(1.5, t), 0.02 * wave(1, t));
  };
  cloth.held[1].motion = [wave](double t) {
    return Eigen::Vector3d(0.4 - 0.02 * wave(1, t), 0.05 * wave(1, t), 0.01 * wave(2, t));
  };
  ParameterSet set{.springs = spring_parameters(SyntheticCloth().fabric, mesh)};
  const Eigen::Matrix3Xd flat = flat_positions(mesh);
  const double tilt = 10.0 / 180.0 * std::numbers::pi;
  set.start_position_m = Eigen::Vector3d::UnitX() * flat.row(0) +
                         Eigen::Vector3d(0, std::sin(tilt), -std::cos(tilt)) * flat.row(1);
  Schedule schedule{.frame_time_s = {}, .time_step_s = kTruthStep};
  for (int f = 0; f < kTruthFrames; ++f) schedule.frame_time_s.push_back(f / 60.0);
  const SimulateResult run = simulate(cloth, {&set, 1}, schedule).front();

  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  input.tracks3d.clear();
  for (int f = 0; f < kTruthFrames; ++f)
    for (int m = 0; m < 25; ++m) {  // a marker on every vertex
      const double sigma_m = m == 0 || m == 4 ? kDriveNoise : kNoise;
      Position3d row{.frame = f,
                     .marker = m,
                     .position_m = run.position_m[static_cast<size_t>(f)].col(m),
                     .sigma_m = sigma_m};
      for (double& coordinate : row.position_m) coordinate += sigma_m * normal(generator);
      input.tracks3d.push_back(row);
    }
  return input;
}

struct Found {
  bool converged = false;
  double chi_square_per_dof = 0;
  Eigen::VectorXd error;      ///< the fabric's seven numbers, in logarithms
  Eigen::VectorXd in_sigmas;  ///< the same over the sigma that the stated noise gives
};

/// Finds the optimum by least squares from the truth.
Found found_in(const FitInput& input, int drive_knots) {
  const FitProblem problem = make_problem(input, {.drive_knots = drive_knots}, 5, 5);
  const Eigen::VectorXd start = start_with(problem, SyntheticCloth().fabric);
  const Eigen::VectorXd truth = start.head(7);
  const RefineResult result =
      refine(problem,
             [&](const TimeSteps&) {
               return std::make_unique<TrajectoryObjective>(problem, kTruthFrames, kTruthStep);
             },
             start, {.least_gain = 1e-5, .exact_in_the_end = false, .loss = Loss::squared}, {});

  const TrajectoryObjective objective(problem, kTruthFrames, kTruthStep);
  const Linearisation linear = objective.linearise(result.values);
  if (!linear.usable) return {};
  const Eigen::MatrixXd covariance =
      (linear.residual_by_coordinate.transpose() * linear.residual_by_coordinate +
       prior_cost(problem, result.values).information)
          .inverse();
  const Uncertainty uncertainty = estimate_uncertainty(
      objective, result.values, {.loss = Loss::squared}, linear.residual_by_coordinate);
  Found found{.converged = result.usable && result.converged,
              .chi_square_per_dof = uncertainty.chi_square_per_dof};
  found.error = (result.values.head(7).array() / truth.array()).log();
  found.in_sigmas = found.error.array() / covariance.diagonal().head(7).array().sqrt();
  return found;
}

TEST(DriveCorrection, TakesTheNoiseOfTheDriveOutOfThePhysics) {
  constexpr int kSeeds = 2, kKnots = 20;
  double plain_error = 0, error = 0, plain_in_sigmas = 0, in_sigmas = 0;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    const FitInput input = driven_input(seed);

    const Found plain = found_in(input, 0);
    const Found corrected = found_in(input, kKnots);

    ASSERT_TRUE(plain.converged && corrected.converged);
    // There are 4140 residuals, so chi-square per degree of freedom is known to 0.022. The error of
    // the prior's own scale adds to that: it is the noise of two tracks of 60 samples.
    EXPECT_GT(plain.chi_square_per_dof, 2);
    EXPECT_NEAR(corrected.chi_square_per_dof, 1, 0.08);
    plain_error += plain.error.squaredNorm();
    error += corrected.error.squaredNorm();
    plain_in_sigmas += plain.in_sigmas.squaredNorm() / (7 * kSeeds);
    in_sigmas += corrected.in_sigmas.squaredNorm() / (7 * kSeeds);
  }
  // The root mean square of 14 normal numbers is 1 to 0.19. That of numbers of which some go
  // together is a little less sure; the drive taken as exact gives 28.
  EXPECT_LT(std::sqrt(in_sigmas), 1.5);
  EXPECT_GT(std::sqrt(plain_in_sigmas), 5);
  EXPECT_LT(std::sqrt(error), 0.2 * std::sqrt(plain_error));
}

TEST(DriveCorrection, LeavesTheCostsOverRecordedStatesAlone) {
  // Given states that were recorded, their held points where the tracks drive them,
  const FitInput input = driven_input(1);
  const FitProblem problem = make_problem(input, {.drive_knots = 4}, 5, 5);
  const Eigen::VectorXd values = start_with(problem, SyntheticCloth().fabric);
  const RecordedStates states =
      simulate_states(problem.cloth, parameter_set(problem, values), kTruthStep, 40 * kTruthStep);
  const StateObjective objective(problem, states, {10, 40}, kTruthStep);

  // when corrections of some millimetres are looked at,
  Eigen::VectorXd corrected = values;
  std::vector<int> drive;
  for (int p = 0; p < problem.space.size(); ++p)
    if (problem.space.parameters[static_cast<size_t>(p)].role == ParameterRole::drive) {
      corrected[p] = 3e-3;
      drive.push_back(p);
    }

  // then transitions do not change.
  ASSERT_EQ(drive.size(), 24u);
  EXPECT_EQ(objective.residuals({corrected}).front(), objective.residuals({values}).front());
  EXPECT_TRUE(objective.linearise(corrected).residual_by_coordinate(Eigen::all, drive).isZero(0));
}

TEST(DriveCorrection, IsALineOfTheReportAndNoListOfParameters) {
  const Fabric truth = SyntheticCloth().fabric;
  FitOptions options{.drive_knots = 4};
  options.start = {{"tension_warp", truth.tension_warp_n_per_m},
                   {"tension_weft", truth.tension_weft_n_per_m},
                   {"shear", truth.shear_n_per_m},
                   {"flexion_warp", truth.flexion_warp_n_per_m},
                   {"flexion_weft", truth.flexion_weft_n_per_m},
                   {"damping_warp", truth.damping_warp_s},
                   {"damping_weft", truth.damping_weft_s}};

  const FitReport report = fit(tracked_corners(), options, {});

  ASSERT_TRUE(report.usable()) << report.message;
  EXPECT_THAT(report.stages, testing::Contains(testing::StartsWith(
                                 "drive corrected at 4 knots for each of 2 tracked points: ")));
  const auto is_of_drive = [](const std::string& name) { return name.starts_with("drive_"); };
  EXPECT_TRUE(std::ranges::none_of(report.correlation_names, is_of_drive));
  EXPECT_TRUE(std::ranges::none_of(report.result.nuisance, is_of_drive, &ParameterEstimate::name));
  EXPECT_TRUE(
      std::ranges::none_of(report.result.parameters, is_of_drive, &ParameterEstimate::name));
}

}  // namespace
}  // namespace clothfit
