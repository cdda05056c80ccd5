// Checks when and where observations see the markers of a run. Each effect of the measurement is
// checked in measurement_effects/; derivatives of whole residuals in objective_test.cpp.
#include "fit/problem/predictor.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

FitProblem problem_with(const std::vector<std::string>& effects) {
  return make_problem(synthetic_input({.frames = 8, .held_out_from = 8}), {.effects = effects}, 9,
                      9);
}

/// Moves every marker on one cubic in time, with its velocity.
MarkerRun cubic_run(const FitProblem& problem, int frames) {
  MarkerRun run;
  const auto markers = problem.marker_place_m.cols();
  for (int f = 0; f < frames; ++f) {
    const double t = problem.frame_time_s[static_cast<size_t>(f)];
    const Eigen::Vector3d at(t * t * t, 1 - 2 * t * t, 3 * t);
    const Eigen::Vector3d speed(3 * t * t, -4 * t, 3);
    run.position_m.push_back(at.replicate(1, markers));
    run.velocity_m_per_s.push_back(speed.replicate(1, markers));
  }
  return run;
}

Eigen::VectorXd with_offset(const FitProblem& problem, double offset_s) {
  Eigen::VectorXd values = problem.space.start();
  values[problem.space.index("clock_offset.time")] = offset_s;
  return values;
}

TEST(Predictor, WithoutMeasurementEffectsSeesTheMarkerAtItsFrame) {
  const FitProblem problem = problem_with({});
  const MarkerRun run = cubic_run(problem, 8);
  const Predictor predictor(problem, problem.space.start());

  EXPECT_FALSE(predictor.needs_velocities());
  EXPECT_EQ(predictor.frames_to_run(5), 5);
  for (const Observation& row : problem.observations[0].rows)
    EXPECT_EQ(*predictor.predict(0, row, run),
              run.position_m[static_cast<size_t>(row.frame)].col(row.marker));
}

TEST(Predictor, FollowsACubicExactlyBetweenFrames) {
  const FitProblem problem = problem_with({"clock_offset"});
  const MarkerRun run = cubic_run(problem, 8);
  for (const double offset_s : {0.0, 1e-3, 0.4 / 60, 1.7 / 60}) {
    const Predictor predictor(problem, with_offset(problem, offset_s));
    ASSERT_TRUE(predictor.needs_velocities());
    for (const Observation& row : problem.observations[0].rows) {
      const double t = problem.frame_time_s[static_cast<size_t>(row.frame)] + offset_s;
      if (t > problem.frame_time_s.back()) continue;
      const Eigen::Vector3d at(t * t * t, 1 - 2 * t * t, 3 * t);
      EXPECT_LT((*predictor.predict(0, row, run) - at).norm(), 1e-14);
    }
  }
}

TEST(Predictor, StandsBeforeTheFirstFrameAndGoesStraightAfterTheLast) {
  // Given a cloth let go flat, whose markers would fly at 3 m/s from the first frame on
  const FitProblem problem = problem_with({"clock_offset"});
  const MarkerRun run = cubic_run(problem, 8);
  const Observation first{.frame = 0, .marker = 0}, last{.frame = 7, .marker = 0};

  const Predictor early(problem, with_offset(problem, -0.01));
  EXPECT_EQ(*early.predict(0, first, run), run.position_m[0].col(0));

  const Predictor late(problem, with_offset(problem, 0.01));
  const Eigen::Vector3d straight_on =
      run.position_m[7].col(0) + 0.01 * run.velocity_m_per_s[7].col(0);
  EXPECT_LT((*late.predict(0, last, run) - straight_on).norm(), 1e-15);
}

TEST(Predictor, RunsOnToTheFrameAfterTheLastOneLookedAt) {
  const FitProblem problem = problem_with({"clock_offset"});
  const auto frames = [&](double offset_s) {
    return Predictor(problem, with_offset(problem, offset_s)).frames_to_run(4);
  };
  EXPECT_EQ(frames(0), 4);
  EXPECT_EQ(frames(0.5 / 60), 5);
  EXPECT_EQ(frames(1.5 / 60), 6);
  EXPECT_EQ(frames(-0.5 / 60), 4);
  EXPECT_EQ(frames(1), 8);  // there are no more
}

TEST(Predictor, ComesStraightToAStartInMotion) {
  FitInput input = synthetic_input({.frames = 8, .held_out_from = 8});
  input.recording.start = StartKind::unknown;
  const FitProblem problem =
      make_problem(input, {.effects = {"clock_offset"}, .start_nodes = 3}, 9, 9);
  const MarkerRun run = cubic_run(problem, 8);
  const Predictor early(problem, with_offset(problem, -0.01));

  const auto seen = early.predict(0, {.frame = 0, .marker = 0}, run);

  EXPECT_LT((*seen - (run.position_m[0].col(0) - 0.01 * run.velocity_m_per_s[0].col(0))).norm(),
            1e-15);
}

TEST(Predictor, FirstLooksUpTheTimeThenMovesThePlaceThenAddsTheMarkersOffset) {
  const FitProblem problem = problem_with({"scale", "clock_offset"});
  const MarkerRun run = cubic_run(problem, 8);
  Eigen::VectorXd values = with_offset(problem, 0.004);
  values[problem.space.index("scale.factor")] = 1.1;
  Predictor predictor(problem, values);
  const Eigen::Vector3d offset_m(0.01, -0.02, 0.03);
  predictor.offset_markers(offset_m.replicate(1, problem.marker_place_m.cols()));

  const auto seen = predictor.predict(0, {.frame = 3, .marker = 0}, run);

  const double t = problem.frame_time_s[3] + 0.004;
  const Eigen::Vector3d at(t * t * t, 1 - 2 * t * t, 3 * t);
  const Eigen::Vector3d middle = problem.placed_sheet_m.rowwise().mean();
  EXPECT_LT((*seen - (middle + 1.1 * (at - middle) + offset_m)).norm(), 1e-14);
}

TEST(Predictor, MixesTheLooksOneFrameIntervalBeforeAndAfter) {
  const FitProblem problem = problem_with({"temporal_smoothing"});
  const MarkerRun run = cubic_run(problem, 8);
  Eigen::VectorXd values = problem.space.start();
  values[problem.space.index("temporal_smoothing.w")] = 0.2;
  const Predictor predictor(problem, values);

  ASSERT_TRUE(predictor.needs_velocities());
  EXPECT_GE(predictor.frames_to_run(4), 5);
  for (const int frame : {1, 3, 6}) {
    // A cubic's second difference is its second derivative.
    const double d = 1.0 / 60, t = problem.frame_time_s[static_cast<size_t>(frame)];
    const Eigen::Vector3d at(t * t * t, 1 - 2 * t * t, 3 * t), bend(6 * t, -4, 0);
    const auto seen = predictor.predict(0, {.frame = frame, .marker = 0}, run);
    EXPECT_LT((*seen - (at + 0.2 * d * d * bend)).norm(), 1e-14);
  }
}

TEST(Predictor, GoesOnBesideAMarkerAsTheSurfaceDoesThereAtTheTimeItLooksAt) {
  // Given a marker that is 2 mm and -3 mm elsewhere, on a paraboloid whose slopes change steadily
  const FitProblem problem = problem_with({"marker_placement", "clock_offset"});
  MarkerRun run = cubic_run(problem, 8);
  const Eigen::Vector3d by_s(1, 0, 0.5), by_t(0, -1, 0.2), by_ss(2, 9, -7), by_st(-3, 8, 1),
      by_tt(5, -6, 12), change(0.3, -4, 2);
  const auto steady = [&](const Eigen::Vector3d& from) {
    MarkerRun derivative;
    for (const double t : problem.frame_time_s) {
      derivative.position_m.push_back(
          (from + t * change).replicate(1, problem.marker_place_m.cols()));
      derivative.velocity_m_per_s.push_back(change.replicate(1, problem.marker_place_m.cols()));
    }
    return derivative;
  };
  run.derivatives = {steady(by_s), steady(by_t), steady(by_ss), steady(by_st), steady(by_tt)};
  Eigen::VectorXd values = with_offset(problem, 0.004);
  values[problem.space.index("marker_placement.shift_s")] = 0.002;
  values[problem.space.index("marker_placement.shift_t")] = -0.003;

  const auto seen = Predictor(problem, values).predict(0, {.frame = 3, .marker = 5}, run);

  const double t = problem.frame_time_s[3] + 0.004;
  const Eigen::Vector3d at(t * t * t, 1 - 2 * t * t, 3 * t);
  const Eigen::Vector3d beside = 0.002 * (by_s + t * change) - 0.003 * (by_t + t * change) +
                                 2e-6 * (by_ss + t * change) - 6e-6 * (by_st + t * change) +
                                 4.5e-6 * (by_tt + t * change);
  EXPECT_LT((*seen - (at + beside)).norm(), 1e-14);
}

TEST(Predictor, LooksBesideMarkersOnlyWhereAnEffectAsks) {
  EXPECT_TRUE(problem_with({"scale", "clock_offset"}).derivative_weights.empty());
  EXPECT_EQ(problem_with({"in_surface_sliding"}).derivative_weights.size(), 5u);
}

}  // namespace
}  // namespace clothfit
