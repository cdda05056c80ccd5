// Checks the recordings that could be made of a cloth: what each changes and what it leaves as it
// is. Not checked here: which hypotheses such a recording tells apart (separation_test.cpp).
#include "fit/diagnosis/candidate_recording.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "calib/camera/projection.h"
#include "fit/cost/objective.h"
#include "fit/problem/parameterised_model.h"
#include "model/effects/registry.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
/// The cloth of 0.4 m was let go 25 degrees out of the vertical. Twelve frames of it are fitted.
constexpr int kSide = 5, kOnce = 12;
const SyntheticCloth kOther{
    .mesh = kSide, .markers = 5, .frames = kOnce + 4, .held_out_from = kOnce};

FitProblem problem_of(const FitInput& input,
                      ObservationKind observations = ObservationKind::tracks3d) {
  return make_problem(input, {.observations = observations}, kSide, kSide);
}

struct Changed {
  std::string what;
  FitProblem problem;
};

/// Returns the recordings of a kind, made of a problem.
std::vector<Changed> changed(const FitProblem& problem, CandidateKind kind) {
  std::vector<Changed> all;
  for (const CandidateRecording& candidate : candidate_recordings(problem)) {
    if (candidate.kind != kind) continue;
    all.push_back({.what = candidate.what, .problem = problem});
    candidate.change(all.back().problem);
  }
  return all;
}

std::set<CandidateKind> kinds_of(const FitProblem& problem) {
  std::set<CandidateKind> kinds;
  for (const CandidateRecording& candidate : candidate_recordings(problem))
    kinds.insert(candidate.kind);
  return kinds;
}

std::vector<Eigen::Vector3d> held_in(const FitProblem& problem) {
  std::vector<Eigen::Vector3d> places;
  for (const HeldVertexWeights& held : problem.cloth.held) {
    places.emplace_back(Eigen::Vector3d::Zero());
    for (const HeldVertexWeights::Weight& at : held.weights)
      places.back() += at.weight * problem.placed_sheet_m.col(at.vertex);
  }
  return places;
}

/// Returns the distances between all vertices of the placed sheet.
Eigen::MatrixXd distances_in(const FitProblem& problem) {
  const Eigen::Matrix3Xd& sheet = problem.placed_sheet_m;
  return Eigen::MatrixXd::NullaryExpr(sheet.cols(), sheet.cols(), [&](auto a, auto b) {
    return (sheet.col(a) - sheet.col(b)).norm();
  });
}

/// Returns how many degrees the placed sheet hangs out of the vertical through its upper edge. Away
/// from the camera is positive.
double out_of_vertical(const FitProblem& problem) {
  const Eigen::Vector3d hanging =
      problem.placed_sheet_m.rowwise().mean() - problem.placed_sheet_m.col(0);
  return std::atan2(hanging.y(), -hanging.z()) / kDegree;
}

TEST(Candidates, OfTwiceTheDurationGoOnAtTheSamePace) {
  FitInput input = synthetic_input(kOther);
  const auto is_gap = [](int frame, int marker) { return frame == 5 && marker == 3; };
  std::erase_if(input.tracks3d,
                [&](const Position3d& row) { return is_gap(row.frame, row.marker); });
  const FitProblem before = problem_of(input);
  const std::vector<Changed> all = changed(before, CandidateKind::duration);
  ASSERT_EQ(all.size(), 1u);
  const FitProblem& after = all.front().problem;

  EXPECT_EQ(all.front().what, "twice as long (0.37 s)");
  ASSERT_EQ(after.frames(), 2 * kOnce);
  EXPECT_EQ(after.first_held_out, 2 * kOnce);
  for (int frame = 0; frame < after.frames(); ++frame)
    EXPECT_NEAR(after.frame_time_s[static_cast<size_t>(frame)], frame / 60.0, 1e-12);
  // Each frame has the markers of the frame that it repeats, and its gaps.
  const std::vector<Observation>& rows = after.observations.front().rows;
  ASSERT_EQ(std::ssize(rows), 2 * (kOnce * 25 - 1));
  for (size_t n = 1; n < rows.size(); ++n)
    EXPECT_LT(std::pair(rows[n - 1].frame, rows[n - 1].marker),
              std::pair(rows[n].frame, rows[n].marker));
  for (const Observation& row : rows) {
    EXPECT_FALSE(is_gap(row.frame % kOnce, row.marker));
    EXPECT_EQ(row.sigma, kOther.noise_m);
  }
  EXPECT_EQ(after.placed_sheet_m, before.placed_sheet_m);
  EXPECT_EQ(after.space.size(), before.space.size());
}

TEST(Candidates, OfTwiceTheDurationMoveHeldPointsOn) {
  FitProblem before = problem_of(synthetic_input(kOther));
  const auto path = [](double time_s) {
    return Eigen::Vector3d(std::sin(7 * time_s), time_s * time_s, std::cos(5 * time_s));
  };
  before.cloth.held[0].motion = path;
  const FitProblem after = changed(before, CandidateKind::duration).front().problem;
  const auto& motion = after.cloth.held[0].motion;
  const double end_s = (kOnce - 1) / 60.0;

  EXPECT_FALSE(after.cloth.held[1].motion);
  EXPECT_EQ(motion(0.5 * end_s), path(0.5 * end_s));
  // Neither the place nor the velocity jumps.
  constexpr double kMoment = 1e-4;
  const Eigen::Vector3d velocity_before = (path(end_s) - path(end_s - kMoment)) / kMoment;
  const Eigen::Vector3d velocity_after = (motion(end_s + kMoment) - motion(end_s)) / kMoment;
  EXPECT_LT((velocity_after - velocity_before).norm(), 1e-9);
  EXPECT_GT(velocity_before.norm(), 1);
  // The path is turned about its end by half a turn.
  for (const double more_s : {0.02, 0.1})
    EXPECT_LT((0.5 * (motion(end_s + more_s) + path(end_s - more_s)) - path(end_s)).norm(), 1e-14);
}

TEST(Candidates, OfTwiceTheFrameRateShowAFrameMoreBetweenEveryTwo) {
  FitProblem before = problem_of(synthetic_input(kOther));
  before.frame_time_s[4] += 0.005;  // a camera that stumbled
  const std::vector<Changed> all = changed(before, CandidateKind::frame_rate);
  ASSERT_EQ(all.size(), 1u);
  const FitProblem& after = all.front().problem;

  EXPECT_EQ(all.front().what, "twice the frame rate (120 Hz)");
  ASSERT_EQ(after.frames(), 2 * kOnce - 1);
  EXPECT_EQ(after.first_held_out, after.frames());
  EXPECT_EQ(std::ssize(after.observations.front().rows), after.frames() * 25);
  for (size_t frame = 0; frame < kOnce; ++frame) {
    EXPECT_EQ(after.frame_time_s[2 * frame], before.frame_time_s[frame]);
    if (frame > 0) {
      EXPECT_NEAR(after.frame_time_s[2 * frame - 1],
                  0.5 * (before.frame_time_s[frame - 1] + before.frame_time_s[frame]), 1e-15);
    }
  }
  EXPECT_EQ(after.placed_sheet_m, before.placed_sheet_m);
}

// The sheet hangs 25 degrees out of the vertical, less or more 20 and 40. It is turned stiffly,
// which stretches no spring.
TEST(Candidates, OfAnotherAttitudeTurnTheSheetAboutItsHeldPoints) {
  SyntheticCloth exact = kOther;
  exact.noise_m = 1e-9;
  const FitProblem before = problem_of(synthetic_input(exact));
  ASSERT_NEAR(out_of_vertical(before), 25, 1e-3);
  const std::vector<Eigen::Vector3d> held = held_in(before);

  const std::vector<Changed> all = changed(before, CandidateKind::attitude);

  const std::vector<std::pair<double, std::string>> expected{
      {-15, "let go 15 degrees out of the vertical on the other side, not 25"},
      {5, "let go 5 degrees out of the vertical, not 25"},
      {45, "let go 45 degrees out of the vertical, not 25"},
      {65, "let go 65 degrees out of the vertical, not 25"}};
  ASSERT_EQ(all.size(), expected.size());
  std::vector<std::pair<double, std::string>> found;
  for (const Changed& one : all) {
    found.emplace_back(std::round(out_of_vertical(one.problem)), one.what);
    EXPECT_NEAR(out_of_vertical(one.problem), found.back().first, 1e-3) << one.what;
    EXPECT_LT((distances_in(one.problem) - distances_in(before)).cwiseAbs().maxCoeff(), 1e-12);
    const std::vector<Eigen::Vector3d> then = held_in(one.problem);
    for (size_t h = 0; h < held.size(); ++h) EXPECT_LT((then[h] - held[h]).norm(), 1e-12);
    EXPECT_EQ(one.problem.frame_time_s, before.frame_time_s);
  }
  std::ranges::sort(found);
  EXPECT_EQ(found, expected);
}

// From 105 degrees on, a sheet at 125 or 145 would stand on its supports.
TEST(Candidates, OfAnotherAttitudeDoNotStandOnTheirSupports) {
  FitProblem problem = problem_of(synthetic_input(kOther));
  const Eigen::Vector3d corner = problem.placed_sheet_m.col(0);
  const Eigen::AngleAxisd turn(80 * kDegree, Eigen::Vector3d::UnitX());
  problem.placed_sheet_m =
      (turn.toRotationMatrix() * (problem.placed_sheet_m.colwise() - corner)).colwise() + corner;
  ASSERT_NEAR(out_of_vertical(problem), 105, 1);

  const std::vector<Changed> all = changed(problem, CandidateKind::attitude);

  ASSERT_EQ(all.size(), 2u);
  for (const Changed& one : all) EXPECT_LT(out_of_vertical(one.problem), 90);
}

// The line is the level one in the sheet through that point.
TEST(Candidates, OfAnotherAttitudeTurnASheetThatHangsFromOnePoint) {
  FitInput input = synthetic_input(kOther);
  input.recording.held = {{.at_m = {0.2, 0}}};
  const FitProblem before = problem_of(input);
  const Eigen::Vector3d held = held_in(before).front();

  const std::vector<Changed> all = changed(before, CandidateKind::attitude);

  ASSERT_EQ(all.size(), 4u);
  for (const Changed& one : all) {
    SCOPED_TRACE(one.what);
    EXPECT_LT((held_in(one.problem).front() - held).norm(), 1e-12);
    const double turned = out_of_vertical(one.problem) - out_of_vertical(before);
    const double expected = 20 * std::round(turned / 20);
    // Noise has turned the sheet about the vertical by so much.
    EXPECT_NEAR(turned, expected, 0.1);
    EXPECT_NE(expected, 0);
  }
}

// A held point leaves its place by amplitude (1 - cos), which begins at rest.
TEST(Candidates, ThatAreShakenMoveHeldPointsAlongAKnownPathFromRest) {
  const FitProblem before = problem_of(synthetic_input(kOther));
  constexpr double kAmplitude_m = 0.02;  // a twentieth of the side
  const std::vector<Changed> all = changed(before, CandidateKind::shaken);
  ASSERT_EQ(all.size(), 4u);
  std::set<std::string> texts;
  for (const Changed& one : all) {
    SCOPED_TRACE(one.what);
    texts.insert(one.what);
    const FitProblem& after = one.problem;
    // No parameter has to be found.
    EXPECT_EQ(after.space.size(), before.space.size());
    EXPECT_EQ(after.frame_time_s, before.frame_time_s);
    const Eigen::Vector3d way = one.what.find("across") != std::string::npos
                                    ? Eigen::Vector3d::UnitY()
                                    : Eigen::Vector3d::UnitX();
    const double frequency_hz = one.what.ends_with("1.5 Hz") ? 1.5 : 3;

    const Eigen::VectorXd values = start_with(after, kOther.fabric);
    const SimulateResult run = run_model(after, {values}, kOnce, TimeSteps(1.0 / 60 / 150)).front();

    ASSERT_TRUE(run.usable());
    Eigen::Vector3d first_way = Eigen::Vector3d::Zero();
    for (size_t frame = 0; frame < kOnce; ++frame)
      for (const HeldVertexWeights& held : after.cloth.held) {
        ASSERT_EQ(held.weights.size(), 1u);
        const int vertex = held.weights.front().vertex;
        const Eigen::Vector3d moved =
            run.position_m[frame].col(vertex) - run.position_m[0].col(vertex);
        const double angle = 2 * std::numbers::pi * frequency_hz * before.frame_time_s[frame];
        const double expected_m = kAmplitude_m * (1 - std::cos(angle));
        if (first_way.isZero() && expected_m > 0) first_way = moved.normalized();
        EXPECT_LT((moved - expected_m * first_way).norm(), 1e-9);
      }
    // Noise has placed the line through the corners, level to some milliradians.
    EXPECT_NEAR(std::abs(first_way.dot(way)), 1, 1e-4);
  }
  EXPECT_EQ(texts, (std::set<std::string>{
                       "held points shaken across the line through them, 20 mm at 1.5 Hz",
                       "held points shaken across the line through them, 20 mm at 3 Hz",
                       "held points shaken along the line through them, 20 mm at 1.5 Hz",
                       "held points shaken along the line through them, 20 mm at 3 Hz"}));
}

TEST(Candidates, ThatAreTurnedHoldOtherCornersAtTheSamePlaces) {
  const FitProblem before = problem_of(synthetic_input(kOther));
  const auto held_vertices = [](const FitProblem& problem) {
    std::set<int> vertices;
    for (const HeldVertexWeights& held : problem.cloth.held)
      for (const HeldVertexWeights::Weight& at : held.weights) vertices.insert(at.vertex);
    return vertices;
  };
  const auto normal_of = [](const FitProblem& problem) {
    const auto corner = [&](int i, int j) -> Eigen::Vector3d {
      return problem.placed_sheet_m.col(problem.cloth.mesh.vertex(i, j));
    };
    return Eigen::Vector3d(
        (corner(0, kSide - 1) - corner(0, 0)).cross(corner(kSide - 1, 0) - corner(0, 0)));
  };
  // The upper corners of 5 x 5 vertices are 0 and 4, the lower ones 20 and 24.
  ASSERT_EQ(held_vertices(before), (std::set{0, 4}));
  const std::vector<Changed> all = changed(before, CandidateKind::turned);
  ASSERT_EQ(all.size(), 2u);
  std::vector<std::set<int>> held;
  for (const Changed& one : all) {
    SCOPED_TRACE(one.what);
    const bool is_quarter = one.what.find("quarter") != std::string::npos;
    held.push_back(held_vertices(one.problem));
    const std::vector<Eigen::Vector3d> then = held_in(one.problem), now = held_in(before);
    for (size_t h = 0; h < now.size(); ++h) EXPECT_LT((then[h] - now[h]).norm(), 1e-15);
    // It is turned stiffly in its plane, and not mirrored.
    EXPECT_LT((distances_in(one.problem) - distances_in(before)).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_LT((normal_of(one.problem) - normal_of(before)).norm(), 1e-12);
    // Two halves or four quarters of a turn leave it as it was.
    FitProblem back = one.problem;
    for (int more = is_quarter ? 3 : 1; more > 0; --more) {
      EXPECT_GT((back.placed_sheet_m - before.placed_sheet_m).norm(), 0.4);
      back = changed(back, CandidateKind::turned)[is_quarter ? 1 : 0].problem;
    }
    EXPECT_EQ(back.placed_sheet_m, before.placed_sheet_m);
    EXPECT_EQ(held_vertices(back), held_vertices(before));
  }
  EXPECT_EQ(held[0], (std::set{20, 24}));                                     // by the lower edge
  EXPECT_TRUE(held[1] == (std::set{0, 20}) || held[1] == (std::set{4, 24}));  // by a side edge
}

// The camera is turned by 45 degrees about the vertical through the sheet's middle.
TEST(Candidates, OfOneMoreCameraSeeTheClothFromTheSide) {
  const FitProblem before = problem_of(synthetic_input(kOther), ObservationKind::tracks2d);
  const std::vector<Changed> all = changed(before, CandidateKind::camera);
  ASSERT_EQ(all.size(), 1u);
  const FitProblem& after = all.front().problem;
  ASSERT_EQ(after.observations.size(), 2u);
  const ObservationSet &first = after.observations[0], &second = after.observations[1];

  EXPECT_EQ(std::ssize(second.rows), std::ssize(first.rows));
  EXPECT_NE(second.kind, first.kind);
  EXPECT_EQ(second.camera->focal_px, first.camera->focal_px);
  EXPECT_EQ(second.camera->distortion, first.camera->distortion);
  const Eigen::Vector3d middle = before.placed_sheet_m.rowwise().mean();
  const auto from_middle = [&](const ObservationSet& set) -> Eigen::Vector3d {
    return inverse(camera_from_world(*set.camera)).translation_m - middle;
  };
  const Eigen::Vector3d here = from_middle(first), there = from_middle(second);
  EXPECT_NEAR(there.norm(), here.norm(), 1e-12);
  EXPECT_NEAR(there.z(), here.z(), 1e-12);
  EXPECT_NEAR(there.head<2>().dot(here.head<2>()) / here.head<2>().squaredNorm(),
              std::cos(45 * kDegree), 1e-12);
  // Both see the middle at one pixel.
  const auto seen_by = [&](const ObservationSet& set) {
    return *project(*set.camera, camera_from_world(*set.camera) * middle);
  };
  EXPECT_LT((seen_by(second) - seen_by(first)).norm(), 1e-9);
}

// The supports stay where they are, and the sheet keeps its shape.
TEST(Candidates, HoldTheClothWhereItWasHeld) {
  const FitProblem before = problem_of(synthetic_input(kOther), ObservationKind::tracks2d);
  const std::vector<Eigen::Vector3d> held = held_in(before);
  std::set<CandidateKind> kinds;
  for (const CandidateRecording& candidate : candidate_recordings(before)) {
    SCOPED_TRACE(candidate.what);
    kinds.insert(candidate.kind);
    FitProblem after = before;
    candidate.change(after);

    const std::vector<Eigen::Vector3d> then = held_in(after);
    ASSERT_EQ(then.size(), held.size());
    for (size_t h = 0; h < held.size(); ++h) EXPECT_LT((then[h] - held[h]).norm(), 1e-12);
    EXPECT_LT((distances_in(after) - distances_in(before)).cwiseAbs().maxCoeff(), 1e-12);
  }
  EXPECT_EQ(kinds.size(), 6u);
}

TEST(Candidates, AreSeenWhereTheModelHasThem) {
  const FitProblem before = problem_of(synthetic_input(kOther), ObservationKind::tracks2d);
  for (const CandidateRecording& candidate : candidate_recordings(before)) {
    SCOPED_TRACE(candidate.what);
    FitProblem after = before;
    candidate.change(after);
    const Eigen::VectorXd values = start_with(after, kOther.fabric);
    const TimeSteps steps = 1.0 / 60 / 150;

    ASSERT_TRUE(observe(after, values, steps));

    const TrajectoryObjective objective(after, after.first_held_out, steps);
    EXPECT_EQ(objective.residuals({values}).front().lpNorm<Eigen::Infinity>(), 0);
    const int frames = candidate.kind == CandidateKind::duration     ? 2 * kOnce
                       : candidate.kind == CandidateKind::frame_rate ? 2 * kOnce - 1
                                                                     : kOnce;
    const int cameras = candidate.kind == CandidateKind::camera ? 2 : 1;
    EXPECT_EQ(after.first_held_out, frames);
    EXPECT_EQ(objective.residual_count(), 2 * 25 * frames * cameras);
  }
}

// The time at which a marker is seen depends on its row of the picture, and that on the time.
TEST(Observe, KnowsWhenARollingShutterSeesEachMarker) {
  FitInput input = synthetic_input(kOther);
  input.recording.declared = {{.name = "rolling_shutter", .parameters = {{"readout", {0.02}}}}};
  FitProblem problem = problem_of(input, ObservationKind::tracks2d);
  const Eigen::VectorXd values = start_with(problem, kOther.fabric);
  const TimeSteps steps = 1.0 / 60 / 150;
  const auto left = [&] {
    return TrajectoryObjective(problem, kOnce, steps).residuals({values}).front();
  };
  ASSERT_GT(left().lpNorm<Eigen::Infinity>(), 1);

  ASSERT_TRUE(observe(problem, values, steps));

  // Each of three passes leaves a part of the error before it: the share of a picture's rows that a
  // marker crosses during the readout, some hundredths.
  EXPECT_LT(left().lpNorm<Eigen::Infinity>(), 1e-2);
}

TEST(Observe, LeavesOutWhatACameraDoesNotSeeAndRefusesHalfOfIt) {
  const FitProblem whole = problem_of(synthetic_input(kOther), ObservationKind::tracks2d);
  const Eigen::VectorXd values = start_with(whole, kOther.fabric);
  const TimeSteps steps = 1.0 / 60 / 150;
  FitProblem seen = whole;
  ASSERT_TRUE(observe(seen, values, steps));
  std::vector<double> columns_px;
  for (const Observation& row : seen.observations.front().rows)
    columns_px.push_back(row.observed.x());
  std::ranges::sort(columns_px);
  const auto count = columns_px.size();
  ASSERT_EQ(count, 25u * kOnce);

  for (const double share : {0.75, 0.25}) {
    SCOPED_TRACE(share);
    FitProblem narrow = whole;
    const auto last = static_cast<size_t>(share * static_cast<double>(count));
    const int width = static_cast<int>(std::lround(columns_px[last]));
    narrow.observations.front().camera->image_width = width;

    EXPECT_EQ(observe(narrow, values, steps), share > 0.5);

    const auto expected = std::ranges::count_if(
        columns_px, [&](double column_px) { return column_px <= width - 0.5; });
    EXPECT_EQ(std::ssize(narrow.observations.front().rows), expected);
  }
}

TEST(Observe, RefusesAModelThatDoesNotRun) {
  FitProblem problem = problem_of(synthetic_input(kOther));
  const Eigen::VectorXd values = start_with(problem, kOther.fabric);

  EXPECT_FALSE(observe(problem, values, TimeSteps(1.0 / 60)));
}

// It depends on the points by which the cloth is held, on its start, and on what it may touch.
TEST(Candidates, AreThoseThatCanBeMade) {
  using Kind = CandidateKind;
  const std::set<Kind> all{Kind::duration, Kind::frame_rate, Kind::attitude, Kind::shaken,
                           Kind::turned};
  const auto without = [&](Kind kind) {
    std::set<Kind> kinds = all;
    kinds.erase(kind);
    return kinds;
  };
  FitInput input = synthetic_input(kOther);
  const FitProblem flat = problem_of(input);
  EXPECT_EQ(kinds_of(flat), all);

  FitProblem touching = flat;
  add_effect(touching.cloth, "contact_plane", "test");
  EXPECT_EQ(kinds_of(touching), without(Kind::attitude));
  FitProblem tracked = flat;
  tracked.driving_markers = {0};
  EXPECT_EQ(kinds_of(tracked), without(Kind::turned));
  FitProblem late = flat;
  for (double& time_s : late.frame_time_s) time_s += 1;
  EXPECT_EQ(kinds_of(late), without(Kind::shaken));
  FitProblem moving = flat;
  moving.start = StartKind::unknown;
  EXPECT_EQ(kinds_of(moving), (std::set{Kind::duration, Kind::frame_rate, Kind::shaken}));

  input.recording.start = StartKind::at_rest;
  EXPECT_EQ(kinds_of(problem_of(input)), without(Kind::attitude));
  input.recording.start = StartKind::released_flat;
  input.recording.held.resize(1);
  EXPECT_EQ(kinds_of(problem_of(input)), all);
  input.recording.held = {{.at_m = {0, 0}}, {.at_m = {0.4, 0}}, {.at_m = {0.2, 0.4}}};
  EXPECT_EQ(kinds_of(problem_of(input)), without(Kind::attitude));
  input.recording.held.clear();
  EXPECT_EQ(kinds_of(problem_of(input)), (std::set{Kind::duration, Kind::frame_rate}));
}

}  // namespace
}  // namespace clothfit
