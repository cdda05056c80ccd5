// Checks states from smoothed 3D tracks and the founding paper's costs over them. The spline is
// checked in smoothing_spline_test.cpp, the costs over exact states in state_objective_test.cpp.
#include "fit/cost/track_states.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "data/input_error.h"
#include "fit/problem/parameterised_model.h"
#include "fit/refine/refine.h"
#include "model/integrate/simulate.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

/// A slow, well damped cloth with a marker at every vertex, filmed at `rate_hz`, and its states.
struct DenseRecording {
  FitProblem problem;
  RecordedStates truth;  ///< states of all frames

  static constexpr Fabric kFabric{.tension_warp_n_per_m = 8,
                                  .tension_weft_n_per_m = 10,
                                  .shear_n_per_m = 4,
                                  .flexion_warp_n_per_m = 2,
                                  .flexion_weft_n_per_m = 1.5,
                                  .damping_warp_s = 8e-3,
                                  .damping_weft_s = 6e-3};

  DenseRecording(double rate_hz, double noise_m, double duration_s) {
    constexpr double kBegin = 0.25;  // s: fast motion at the start is over
    SyntheticCloth cloth{
        .fabric = kFabric, .mesh = 5, .markers = 5, .frames = 2, .held_out_from = 2};
    FitInput input = synthetic_input(cloth);
    // The run is simulated here, from a flat start, so that velocities are known and recording
    // begins later.
    problem = make_problem(input, {}, 5, 5);
    Eigen::VectorXd values = true_values();
    ParameterSet set = parameter_set(problem, values);
    Schedule schedule{.frame_time_s = {0}, .time_step_s = 1e-4, .velocities = true};
    const int frames = static_cast<int>(std::lround(duration_s * rate_hz)) + 1;
    for (int f = 0; f < frames; ++f) schedule.frame_time_s.push_back(kBegin + f / rate_hz);
    SimulateResult run = simulate(problem.cloth, {&set, 1}, schedule).front();
    truth.time_s = {schedule.frame_time_s.begin() + 1, schedule.frame_time_s.end()};
    truth.position_m = {run.position_m.begin() + 1, run.position_m.end()};
    truth.velocity_m_per_s = {run.velocity_m_per_s.begin() + 1, run.velocity_m_per_s.end()};

    problem.frame_time_s = truth.time_s;
    problem.first_held_out = frames;
    std::mt19937_64 generator(3);
    std::normal_distribution<double> normal;
    std::vector<Observation>& rows = problem.observations.front().rows;
    rows.clear();
    const auto markers = marker_positions(problem.vertex_weights, truth.position_m);
    for (int f = 0; f < frames; ++f)
      for (int m = 0; m < 25; ++m) {
        Eigen::Vector3d noise;
        for (double& coordinate : noise) coordinate = normal(generator);
        rows.push_back({.frame = f,
                        .marker = m,
                        .observed = markers[static_cast<size_t>(f)].col(m) + noise_m * noise,
                        .sigma = std::max(noise_m, 1e-6)});
      }
  }

  Eigen::VectorXd true_values() const { return start_with(problem, kFabric); }
};

/// Largest errors of a coordinate, 0.2 s from the tracks' ends and further.
struct StateError {
  double position_m = 0, velocity_m_per_s = 0;

  StateError(const DenseRecording& recording, const TrackStates& found) {
    const double first_s = recording.truth.time_s.front(), last_s = recording.truth.time_s.back();
    for (size_t n = 0; n < found.frame.size(); ++n) {
      const auto f = static_cast<size_t>(found.frame[n]);
      const double time_s = recording.truth.time_s[f];
      EXPECT_EQ(found.states.time_s[n], time_s);
      if (time_s - first_s < 0.2 || last_s - time_s < 0.2) continue;
      const auto largest = [](const Eigen::Matrix3Xd& difference) {
        return difference.cwiseAbs().maxCoeff();
      };
      position_m =
          std::max(position_m, largest(found.states.position_m[n] - recording.truth.position_m[f]));
      velocity_m_per_s = std::max(velocity_m_per_s, largest(found.states.velocity_m_per_s[n] -
                                                            recording.truth.velocity_m_per_s[f]));
    }
  }
};

TEST(TrackStates, ApproachTheTruthAsTheFrameRateGrows) {
  std::vector<StateError> error;
  for (const double rate_hz : {30.0, 60.0, 120.0, 240.0}) {
    const DenseRecording recording(rate_hz, 0, 1.0);
    error.emplace_back(recording, recorded_states_of_tracks(recording.problem));
  }
  // Errors of cubic splines go with the fourth power of the interval in positions, with the third
  // in velocities. The slowest rates do not resolve all of the motion yet.
  EXPECT_GT(error[1].position_m, 8 * error[2].position_m);
  EXPECT_GT(error[2].position_m, 8 * error[3].position_m);
  EXPECT_GT(error[0].velocity_m_per_s, 5 * error[1].velocity_m_per_s);
  EXPECT_GT(error[1].velocity_m_per_s, 5 * error[2].velocity_m_per_s);
  // Velocities reach 1.9 m/s. The scheme's velocity at a time is that of half a step before: 18
  // m/s2 times 5e-5 s.
  EXPECT_LT(error[3].position_m, 5e-6);
  EXPECT_LT(error[3].velocity_m_per_s, 1.2e-3);
}

TEST(TrackStates, AreNotDrawnAwayByAnOutlier) {
  // Given one place of a marker in the middle that is off by 30 times the noise
  constexpr int kFrame = 36, kMarker = 12;
  DenseRecording recording(120, 1e-4, 0.6);
  for (Observation& row : recording.problem.observations.front().rows)
    if (row.frame == kFrame && row.marker == kMarker) row.observed.z() += 3e-3;

  const TrackStates found = recorded_states_of_tracks(recording.problem);

  const auto at = std::ranges::find(found.frame, kFrame);
  ASSERT_NE(at, found.frame.end());
  const auto n = static_cast<size_t>(at - found.frame.begin());
  EXPECT_LT((found.states.position_m[n] - recording.truth.position_m[kFrame]).col(kMarker).norm(),
            5e-4);
}

TEST(TrackStates, LeaveOutFramesThatMissTooManyMarkers) {
  // Given a third of the markers hidden for ten frames, one for longer, another for two
  DenseRecording recording(120, 1e-4, 0.6);
  std::erase_if(recording.problem.observations.front().rows, [](const Observation& row) {
    const bool hand = row.marker < 8 && row.frame >= 30 && row.frame < 40;
    const bool one = row.marker == 12 && row.frame >= 42 && row.frame < 52;
    const bool blink = row.marker == 13 && row.frame >= 20 && row.frame < 22;
    return hand || one || blink;
  });

  const TrackStates found = recorded_states_of_tracks(recording.problem);

  // Then there are no states while the hand is there, nor at the ends of the tracks.
  std::vector<int> expected;
  for (int f = 3; f < 70; ++f)
    if (f < 30 || f >= 40) expected.push_back(f);
  EXPECT_EQ(found.frame, expected);
  EXPECT_EQ(found.left_out, 10 + 6);
  EXPECT_NEAR(found.states.time_s[27] - found.states.time_s[26], 11.0 / 120, 1e-12);
  // The surface goes on where one marker is missing: a node in the middle of the cloth.
  for (size_t n = 0; n < found.frame.size(); ++n) {
    const auto f = static_cast<size_t>(found.frame[n]);
    const double off_m =
        (found.states.position_m[n] - recording.truth.position_m[f]).col(12).norm();
    const bool missing = f >= 42 && f < 52;
    EXPECT_LT(off_m, missing ? 2e-2 : 1e-3) << f;
  }
}

TEST(TrackStates, AreRefusedWhereThereAreNone) {
  const FitProblem pixels = make_problem(synthetic_input({.mesh = 5, .markers = 5}),
                                         {.observations = ObservationKind::tracks2d}, 5, 5);
  const FitProblem brief = make_problem(
      synthetic_input({.mesh = 5, .markers = 5, .frames = 7, .held_out_from = 7}), {}, 5, 5);

  EXPECT_FALSE(find_states_of_tracks(pixels));
  EXPECT_FALSE(find_states_of_tracks(brief));
  EXPECT_THROW(recorded_states_of_tracks(pixels), InputError);
  EXPECT_THROW(recorded_states_of_tracks(brief), InputError);
}

/// Returns the largest |log| of the ratio to the truth, over the five stiffnesses.
double stiffness_error(const DenseRecording& recording, const Eigen::VectorXd& values) {
  return (values.head(5).array() / recording.true_values().head(5).array()).log().abs().maxCoeff();
}

TEST(TrackStates, LeadThePapersCostsNearTheStiffnessButNotTheDamping) {
  // Given motion that 60 Hz resolve, seen with 0.1 mm of noise, and a start in the middle of the
  // ranges
  const DenseRecording recording(60, 1e-4, 1.0);
  const FitProblem& problem = recording.problem;
  const TrackStates tracks = recorded_states_of_tracks(problem);
  const double start_error = stiffness_error(recording, problem.space.start());
  std::mt19937_64 generator(1);
  std::uniform_real_distribution<double> share;
  double best_of_random = std::numeric_limits<double>::infinity();
  for (int n = 0; n < 1000; ++n) {
    Eigen::VectorXd drawn = problem.space.start();
    for (int p = 0; p < 5; ++p) {
      const FitParameter& parameter = problem.space.parameters[static_cast<size_t>(p)];
      drawn[p] = parameter.lower * std::pow(parameter.upper / parameter.lower, share(generator));
    }
    best_of_random = std::min(best_of_random, stiffness_error(recording, drawn));
  }
  for (const bool full : {true, false}) {
    SCOPED_TRACE(full ? "full" : "small");
    const auto objective_at = [&](const TimeSteps& steps) {
      return state_objective_of_tracks(problem, tracks, full, steps);
    };

    const RefineResult result =
        refine(problem, objective_at, problem.space.start(), {.loss = Loss::squared}, {});

    ASSERT_TRUE(result.usable) << result.message;
    // The errors seen were 3.5 % of the whole record, 5 % of its last transition.
    EXPECT_LT(stiffness_error(recording, result.values), full ? 0.05 : 0.08);
    EXPECT_GT(start_error, 0.3);
    EXPECT_GT(best_of_random, 0.2);
    // The fast motion that smoothing removes passes for damping.
    const Eigen::VectorXd ratio =
        result.values.array() / recording.true_values().array().max(1e-12);
    EXPECT_GT(ratio[problem.space.index("damping_warp")], 1.1);
    EXPECT_GT(ratio[problem.space.index("damping_weft")], 1.3);
    // Derivatives are exact here too.
    const auto objective = objective_at(result.time_step_s);
    const Linearisation exact = objective->linearise(result.values);
    const Linearisation central = objective->linearise(result.values, Derivatives::central, 1e-5);
    ASSERT_TRUE(exact.usable && central.usable);
    EXPECT_LT((exact.residual_by_coordinate - central.residual_by_coordinate).norm(),
              1e-6 * exact.residual_by_coordinate.norm());
  }
}

}  // namespace
}  // namespace clothfit
