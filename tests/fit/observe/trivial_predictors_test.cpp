// Checks predictions without physics. Not checked here: their place in a report (report_test.cpp),
// and the reading of tracks (tests/data/tables_test.cpp).

#include "fit/observe/trivial_predictors.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <vector>

#include "data/recording.h"
#include "data/tracks.h"

namespace clothfit {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// The frames have uneven times.
const std::vector<double> kTime_s = {0, 0.1, 0.25, 0.3, 0.4, 0.6, 0.7, 1.0};
constexpr int kHeldOutFrom = 5;

/// Returns two markers at constant velocities: (1, 2) and (-3, 0.5) per second.
std::vector<Eigen::MatrixXd> straight_tracks() {
  std::vector<Eigen::MatrixXd> tracks(2, Eigen::MatrixXd(2, 8));
  for (Eigen::Index f = 0; f < 8; ++f) {
    const double t = kTime_s[static_cast<size_t>(f)];
    tracks[0].col(f) << 5 + t, 2 * t;
    tracks[1].col(f) << -3 * t, 7 + 0.5 * t;
  }
  return tracks;
}

TEST(TrivialPredictors, FirstFrameStays) {
  const auto tracks = straight_tracks();

  const TrivialPrediction first = predict_first_frame(tracks, kHeldOutFrom);

  // The mean of the four squared speeds (1, 4, 9, 0.25) times t^2 is 3.5625 t^2.
  for (size_t f = 0; f < 8; ++f) {
    EXPECT_NEAR(first.rms_by_frame[f], std::sqrt(3.5625) * kTime_s[f], 1e-12);
    EXPECT_EQ(first.predicted[1].col(static_cast<Eigen::Index>(f)), Eigen::Vector2d(0, 7));
  }
  EXPECT_NEAR(first.held_out_rms, std::sqrt(3.5625 * (0.36 + 0.49 + 1.0) / 3), 1e-12);
  EXPECT_EQ(first.held_out_count, 12);
  EXPECT_EQ(first.late_markers, 0);
}

TEST(TrivialPredictors, LastVelocityIsRightForConstantVelocity) {
  const TrivialPrediction last = predict_last_velocity(kTime_s, straight_tracks(), kHeldOutFrom);

  EXPECT_LT(last.held_out_rms, 1e-14);
  EXPECT_EQ(last.held_out_count, 12);
  EXPECT_TRUE(std::isnan(last.rms_by_frame[4]));  // says nothing of the fitted frames
}

TEST(TrivialPredictors, LastVelocityIsTheMeanOfTheLastFour) {
  auto tracks = straight_tracks();
  tracks[0].col(0).setConstant(1e6);  // before the last five fitted frames, 1 ... 5
  tracks[0].col(5) += Eigen::Vector2d(0.3, 0);

  const TrivialPrediction last = predict_last_velocity(kTime_s, tracks, 6);

  // Frame 5 lies 0.3 too far, 0.5 s after frame 1: the velocity is 0.6 too large.
  EXPECT_NEAR(last.predicted[0](0, 7), 5 + 1.0 + 0.3 + 0.4 * 0.6, 1e-12);
  EXPECT_NEAR(last.predicted[0](1, 7), 2.0, 1e-12);
}

TEST(TrivialPredictors, LastVelocityMakesDoWithTwoOfTheFiveFrames) {
  auto tracks = straight_tracks();
  tracks[0].col(4).setConstant(kNan);
  tracks[0].col(2).setConstant(kNan);
  tracks[1].middleCols(1, 4).setConstant(kNan);

  const TrivialPrediction last = predict_last_velocity(kTime_s, tracks, kHeldOutFrom);

  EXPECT_NEAR(last.predicted[0](0, 7), 6, 1e-12);
  EXPECT_TRUE(std::isnan(last.predicted[1](0, 7)));
  EXPECT_EQ(last.unpredicted_markers, 1);
  EXPECT_EQ(last.held_out_count, 6);
}

TEST(TrivialPredictors, RigidMovesWithTheHeldPoints) {
  // The whole sheet is carried along: rigid is exact, also for a marker that comes into sight late.
  std::vector<Eigen::MatrixXd> tracks(3, Eigen::MatrixXd(2, 8));
  for (Eigen::Index f = 0; f < 8; ++f) {
    const double t = kTime_s[static_cast<size_t>(f)];
    const Eigen::Vector2d carried(std::sin(3 * t), t * t);
    for (size_t m = 0; m < 3; ++m)
      tracks[m].col(f) = carried + Eigen::Vector2d(static_cast<double>(m), 1);
  }
  tracks[2].leftCols(2).setConstant(kNan);

  const TrivialPrediction rigid =
      predict_rigid(tracks, mean_displacement({tracks[0], tracks[1]}), kHeldOutFrom);

  EXPECT_LT(rigid.held_out_rms, 1e-14);
  EXPECT_EQ(rigid.held_out_count, 18);
  EXPECT_EQ(rigid.late_markers, 1);
}

TEST(TrivialPredictors, RigidIsFirstFrameWhereTheHeldPointsRest) {
  const auto tracks = straight_tracks();

  const TrivialPrediction rigid = predict_rigid(tracks, Eigen::MatrixXd::Zero(2, 8), kHeldOutFrom);

  EXPECT_EQ(rigid.held_out_rms, predict_first_frame(tracks, kHeldOutFrom).held_out_rms);
}

TEST(TrivialPredictors, MeanDisplacementUsesThePointsThatAreSeen) {
  auto tracks = straight_tracks();
  tracks[1].col(3).setConstant(kNan);
  auto unseen_at_first = tracks[0];
  unseen_at_first.col(0).setConstant(kNan);
  tracks.push_back(unseen_at_first);

  const Eigen::MatrixXd mean = mean_displacement(tracks);

  EXPECT_LT((mean.col(2) - Eigen::Vector2d(-1, 1.25) * 0.25).norm(), 1e-12);
  EXPECT_LT((mean.col(3) - Eigen::Vector2d(1, 2) * 0.3).norm(), 1e-12);
}

TEST(TrivialPredictors, UseNothingOfTheHeldOutFrames) {
  const auto tracks = straight_tracks();
  auto other = tracks;
  for (Eigen::MatrixXd& track : other) track.rightCols(3).array() += 9;

  for (size_t m = 0; m < 2; ++m) {
    EXPECT_EQ(predict_first_frame(tracks, kHeldOutFrom).predicted[m],
              predict_first_frame(other, kHeldOutFrom).predicted[m]);
    EXPECT_EQ(predict_last_velocity(kTime_s, tracks, kHeldOutFrom).predicted[m].rightCols(3),
              predict_last_velocity(kTime_s, other, kHeldOutFrom).predicted[m].rightCols(3));
  }
}

TEST(TrivialPredictors, SayNothingOfAMarkerNeverSeenBefore) {
  auto tracks = straight_tracks();
  tracks[0].leftCols(kHeldOutFrom).setConstant(kNan);

  const TrivialPrediction first = predict_first_frame(tracks, kHeldOutFrom);

  EXPECT_TRUE(first.predicted[0].hasNaN());
  EXPECT_EQ(first.unpredicted_markers, 1);
  EXPECT_EQ(first.held_out_count, 6);
}

TEST(TrivialPredictors, HaveNoErrorWithoutHeldOutFrames) {
  const TrivialPrediction first = predict_first_frame(straight_tracks(), 8);

  EXPECT_TRUE(std::isnan(first.held_out_rms));
  EXPECT_EQ(first.held_out_count, 0);
  EXPECT_TRUE(predict_first_frame({}, 3).rms_by_frame.empty());
}

/// Reads a table of the measured positions, as many frames as the recording has.
template <class Tracks, class Position>
std::vector<Eigen::MatrixXd> table(const Tracks& tracks, size_t markers, int coordinates,
                                   const Position& position) {
  int frames = 0;
  for (const auto& row : tracks) frames = std::max(frames, row.frame + 1);
  std::vector<Eigen::MatrixXd> matrices(markers,
                                        Eigen::MatrixXd::Constant(coordinates, frames, kNan));
  for (const auto& row : tracks)
    matrices[static_cast<size_t>(row.marker)].col(row.frame) = position(row);
  return matrices;
}

std::vector<double> frame_times(const Recording& recording, size_t frames) {
  std::vector<double> time_s;
  for (size_t f = 0; f < frames; ++f) time_s.push_back(recording.frame_time_s(static_cast<int>(f)));
  return time_s;
}

/// Returns the tracks of the markers seen in all of `frames`; the others become all gaps.
std::vector<Eigen::MatrixXd> seen_in(std::vector<Eigen::MatrixXd> tracks,
                                     const std::vector<Eigen::Index>& frames) {
  for (Eigen::MatrixXd& track : tracks)
    if (!track(Eigen::all, frames).allFinite()) track.setConstant(kNan);
  return tracks;
}

TEST(TrivialPredictors, ReproduceThePublishedNumbersOfABundledRecording) {
  // Another program computed rms distances over frames 50 to 71 on the measured tracks when the
  // recording was made. A marker that stays has 51.1 mm and 24.2 px, one that goes on 65.3 mm and
  // 25.2 px. That program left out markers that a frame it needed did not show.
  const std::filesystem::path folder =
      std::filesystem::path(CLOTHFIT_SOURCE_DIR) / "data/recordings/swing_plain";
  const Recording recording = read_recording(folder);
  const int from = recording.held_out_from_frame.value();
  const size_t markers = recording.markers.markers.size();
  const auto tracks3d = table(read_tracks3d(recording.tracks3d.value(), recording.markers), markers,
                              3, [](const Position3d& row) { return row.position_m; });
  const auto tracks2d = table(read_tracks2d(recording.tracks2d.at("front"), recording.markers),
                              markers, 2, [](const Position2d& row) { return row.position_px; });
  const auto time_s = frame_times(recording, 72);

  const auto first = [&](const std::vector<Eigen::MatrixXd>& tracks) {
    return predict_first_frame(seen_in(tracks, {0}), from).held_out_rms;
  };
  const auto last = [&](const std::vector<Eigen::MatrixXd>& tracks) {
    return predict_last_velocity(time_s, seen_in(tracks, {45, 49}), from).held_out_rms;
  };
  EXPECT_NEAR(first(tracks3d) * std::sqrt(3), 0.0511, 5e-5);
  EXPECT_NEAR(last(tracks3d) * std::sqrt(3), 0.0653, 5e-5);
  EXPECT_NEAR(first(tracks2d) * std::sqrt(2), 24.2, 0.05);
  EXPECT_NEAR(last(tracks2d) * std::sqrt(2), 25.2, 0.05);

  // With the markers that came into sight later the numbers are about the same.
  EXPECT_EQ(predict_first_frame(tracks3d, from).late_markers, 4);
  EXPECT_NEAR(predict_first_frame(tracks3d, from).held_out_rms * std::sqrt(3), 0.0511, 5e-4);
}

}  // namespace
}  // namespace clothfit
