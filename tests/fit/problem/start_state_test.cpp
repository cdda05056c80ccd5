// Checks a cloth that was moving before its recording began. Shapes from pixels alone are judged
// here by the first state to which they lead; fits from such a start in
// tests/apps/study/trials/recover_test.cpp.
#include "fit/problem/start_state.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fit/cost/objective.h"
#include "fit/problem/parameterised_model.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

constexpr int kCut = 15;  ///< frames: a quarter of a second into the swing

/// The synthetic cloth recorded from its frame kCut on, and the same without noise.
struct CutRecording {
  FitInput input;
  Tracks3d exact;

  int first = 0;  ///< frame of the whole recording

  explicit CutRecording(double noise_m, int first_frame = kCut) : first(first_frame) {
    const SyntheticCloth truth{.frames = 50 + first, .held_out_from = 50, .noise_m = noise_m};
    input = synthetic_input(truth);
    input.recording.start = StartKind::unknown;
    cut(input.tracks3d);
    for (auto& [camera, tracks] : input.tracks2d) cut(tracks);
    SyntheticCloth clean = truth;
    clean.noise_m = 1e-9;
    exact = synthetic_input(clean).tracks3d;
    cut(exact);
  }

  template <class Tracks>
  void cut(Tracks& tracks) const {
    std::erase_if(tracks, [&](const auto& row) { return row.frame < first; });
    for (auto& row : tracks) row.frame -= first;
  }

  /// Returns the place of a marker, NaN where there is none.
  Eigen::Vector3d place(int marker, int frame) const {
    for (const Position3d& row : exact)
      if (row.marker == marker && row.frame == frame) return row.position_m;
    return Eigen::Vector3d::Constant(NAN);
  }
};

/// Root mean square errors of the guessed first state at the markers.
struct GuessError {
  double position_m = 0, velocity_m_per_s = 0, speed_m_per_s = 0;
};

GuessError guess_error(const CutRecording& recording, ObservationKind kind) {
  const FitProblem problem = make_problem(recording.input, {.observations = kind}, 9, 9);
  const ParameterSet set = parameter_set(problem, problem.space.start());
  const auto at_markers =
      marker_positions(problem.vertex_weights, {set.start_position_m, set.start_velocity_m_per_s});
  GuessError error;
  const int markers = static_cast<int>(at_markers[0].cols());
  for (int m = 0; m < markers; ++m) {
    const Eigen::Vector3d now = recording.place(m, 0);
    // The error is of second order in the frame interval.
    const Eigen::Vector3d velocity =
        60 * (-1.5 * now + 2 * recording.place(m, 1) - 0.5 * recording.place(m, 2));
    error.position_m += (at_markers[0].col(m) - now).squaredNorm() / markers;
    error.velocity_m_per_s += (at_markers[1].col(m) - velocity).squaredNorm() / markers;
    error.speed_m_per_s += velocity.squaredNorm() / markers;
  }
  error.position_m = std::sqrt(error.position_m);
  error.velocity_m_per_s = std::sqrt(error.velocity_m_per_s);
  error.speed_m_per_s = std::sqrt(error.speed_m_per_s);
  return error;
}

int corrected_nodes(int first_frame, ObservationKind kind) {
  const CutRecording recording(5e-4, first_frame);
  return make_problem(recording.input, {.observations = kind}, 9, 9).start_state.nodes();
}

TEST(StartState, HasMoreCorrectionsWhereTheFirstShapeIsWavy) {
  for (const ObservationKind kind : {ObservationKind::tracks3d, ObservationKind::tracks2d}) {
    EXPECT_EQ(corrected_nodes(3, kind), 16) << "a twentieth of a second into the swing";
    EXPECT_EQ(corrected_nodes(kCut, kind), 64);
  }
}

TEST(StartState, IsGuessedFromTracksInSpace) {
  const GuessError error = guess_error(CutRecording(5e-4), ObservationKind::tracks3d);

  EXPECT_LT(error.position_m, 2e-3);
  EXPECT_LT(error.velocity_m_per_s, 0.5 * error.speed_m_per_s);
}

TEST(StartState, IsGuessedFromOneCamerasPixels) {
  const GuessError error = guess_error(CutRecording(5e-4), ObservationKind::tracks2d);

  EXPECT_LT(error.position_m, 1e-2);  // of 0.4 m; the camera stands 1 m away
  EXPECT_LT(error.velocity_m_per_s, 0.5 * error.speed_m_per_s);
}

TEST(StartState, IsTheSameGuessOnEveryMesh) {
  const CutRecording recording(5e-4);
  for (const ObservationKind kind : {ObservationKind::tracks3d, ObservationKind::tracks2d}) {
    const FitProblem coarse = make_problem(recording.input, {.observations = kind}, 7, 7);
    const FitProblem fine = make_problem(recording.input, {.observations = kind}, 13, 13);
    for (int i = 0; i < 7; ++i)
      for (int j = 0; j < 7; ++j)
        EXPECT_LT((coarse.start_state.position_m.col(coarse.cloth.mesh.vertex(i, j)) -
                   fine.start_state.position_m.col(fine.cloth.mesh.vertex(2 * i, 2 * j)))
                      .norm(),
                  1e-12);
  }
}

TEST(StartState, CorrectionsHaveTheDerivativesThatDifferencesShow) {
  const CutRecording recording(5e-4);
  const FitProblem problem = make_problem(
      recording.input, {.observations = ObservationKind::tracks2d, .start_nodes = 3}, 7, 7);
  constexpr int kFabric = 7, kTilt = 2;
  EXPECT_EQ(problem.space.size(), kFabric + kTilt + 2 * 3 * 9);
  Eigen::VectorXd values = problem.space.start();
  for (int p = kFabric; p < problem.space.size(); ++p) values[p] = 2e-3 * (p % 5 - 2);
  const TrajectoryObjective objective(problem, 8, 1.0 / 60 / 100);

  const Linearisation exact = objective.linearise(values);
  const Linearisation central = objective.linearise(values, Derivatives::central);

  ASSERT_TRUE(exact.usable && central.usable);
  for (int p = 0; p < problem.space.size(); ++p)
    EXPECT_LT((exact.residual_by_coordinate.col(p) - central.residual_by_coordinate.col(p)).norm(),
              1e-5 * exact.residual_by_coordinate.col(p).norm())
        << problem.space.parameters[static_cast<size_t>(p)].name;
}

}  // namespace
}  // namespace clothfit
