// Checks errors of tracks. Not checked here: their use in a study
// (tests/apps/study/recordings/recordings_study_test.cpp).

#include "fit/observe/marker_error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace clothfit {
namespace {

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

/// Markers that are off along x by these distances, frame by frame.
struct Tracks {
  std::vector<Eigen::MatrixXd> observed, predicted;
  void add(const std::vector<double>& off) {
    const auto frames = static_cast<Eigen::Index>(off.size());
    observed.push_back(Eigen::MatrixXd::Constant(3, frames, 0.5));
    predicted.push_back(observed.back());
    for (Eigen::Index f = 0; f < frames; ++f) predicted.back()(0, f) += off[static_cast<size_t>(f)];
  }
};

TEST(MarkerError, IsTheRootOfTheMeanSquaredDistance) {
  Tracks tracks;
  tracks.add({3, 4, kMissing});
  tracks.add({0, kMissing, 5});

  EXPECT_DOUBLE_EQ(rms_distance(tracks.observed, tracks.predicted), std::sqrt(50.0 / 4));
}

TEST(MarkerError, AWeighedMarkerCountsByItsMeanOverItsOwnFrames) {
  Tracks tracks;
  tracks.add({3, 3, 3});
  tracks.add({5, kMissing, kMissing});
  tracks.add({kMissing, kMissing, kMissing});  // never seen: in neither sum

  EXPECT_DOUBLE_EQ(weighted_rms_distance(tracks.observed, tracks.predicted, {1, 0.25, 9}),
                   std::sqrt((9 + 0.25 * 25) / 1.25));
}

TEST(MarkerError, WithEqualWeightsAndEveryPlaceSeenWeighingChangesNothing) {
  Tracks tracks;
  tracks.add({1, 2});
  tracks.add({3, 4});

  EXPECT_DOUBLE_EQ(weighted_rms_distance(tracks.observed, tracks.predicted, {2, 2}),
                   rms_distance(tracks.observed, tracks.predicted));
}

TEST(MarkerError, CentringTakesOffTheMeanOfTheFittedFramesOnly) {
  Tracks tracks;
  tracks.add({2, 4, kMissing, 7});
  tracks.add({kMissing, kMissing, 1, 1});  // not seen while fitted: stays

  const auto shifted = centred(tracks.observed, tracks.predicted, 2);

  // Markers are off by -1, 1 and 4 in place of 2, 4 and 7.
  EXPECT_DOUBLE_EQ(rms_distance(tracks.observed, shifted), std::sqrt((1.0 + 1 + 16 + 1 + 1) / 5));
}

TEST(MarkerError, IsNoNumberWhereNothingCounts) {
  Tracks tracks;
  tracks.add({kMissing});

  EXPECT_TRUE(std::isnan(rms_distance(tracks.observed, tracks.predicted)));
  EXPECT_TRUE(std::isnan(weighted_rms_distance(tracks.observed, tracks.predicted, {1})));
}

}  // namespace
}  // namespace clothfit
