// Checks that a drawn sheet of markers is followed: no drift, covered markers, light, threads.
// Single patches are in align_patch_test.cpp.

#include "vision/texture/texture_tracker.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <Eigen/LU>
#include <cmath>
#include <map>
#include <opencv2/imgproc.hpp>

#include "data/input_error.h"
#include "tests/vision/drawn_texture.h"

namespace clothfit {
namespace {

constexpr int kAcross = 4;
constexpr double kSpacing_px = 22, kFirst_px = 42;
constexpr double kPx_m = 1e-3;
const cv::Size kSheetPicture(150, 150);
const Eigen::Vector2d kMiddle_px(75, 75);

/// A sheet, one millimetre a pixel, that turns, stretches and shifts by up to 8 px.
struct DrawnSheet {
  DrawnTexture texture{5};
  std::vector<Marker> markers;
  std::vector<FirstPlace> places;

  DrawnSheet() {
    for (int row = 0; row < kAcross; ++row)
      for (int column = 0; column < kAcross; ++column) {
        const Eigen::Vector2d place(kFirst_px + kSpacing_px * column,
                                    kFirst_px + kSpacing_px * row);
        markers.push_back({.name = std::to_string(markers.size()),
                           .s_m = kPx_m * place.x(),
                           .t_m = kPx_m * place.y(),
                           .tag = {},
                           .corner = {}});
        places.push_back({.pixel_px = place, .sigma_px = 0});
      }
  }
  TextureLayout layout() const {
    return {markers, places, kPx_m * kSheetPicture.width, kPx_m * kSheetPicture.height};
  }
  static Eigen::Matrix2d turn(int frame) {
    const double phase = 0.2 * frame, angle = 0.15 * std::sin(phase);
    Eigen::Matrix2d result;
    result << std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle);
    return result * Eigen::Vector2d(1 - 0.1 * std::abs(std::sin(0.7 * phase)), 1).asDiagonal();
  }
  static Eigen::Vector2d shift(int frame) {
    return {8 * std::sin(0.2 * frame), 5 * std::sin(0.31 * frame)};
  }
  static Eigen::Vector2d place_at(const Eigen::Vector2d& first_px, int frame) {
    return kMiddle_px + turn(frame) * (first_px - kMiddle_px) + shift(frame);
  }
  cv::Mat picture(int frame, double noise_levels = 1.5, double gain = 1) const {
    const Eigen::Matrix2d back = turn(frame).inverse();
    return texture.draw(
        kSheetPicture,
        [&](const Eigen::Vector2d& y) -> Eigen::Vector2d {
          return kMiddle_px + back * (y - kMiddle_px - shift(frame));
        },
        noise_levels, static_cast<std::uint64_t>(1000 + frame),
        [&](const Eigen::Vector2d&, double level) { return gain * level; });
  }
  double rms_px(const TextureFrame& frame, int number) const {
    double squares = 0;
    for (const TextureRow& row : frame.rows)
      squares += (row.pixel_px - place_at(places[static_cast<size_t>(row.marker)].pixel_px, number))
                     .squaredNorm();
    return std::sqrt(squares / (2 * static_cast<double>(frame.rows.size())));
  }
};

TEST(TextureTracker, DoesNotDriftOverAHundredPictures) {
  const DrawnSheet sheet;
  TextureTracker tracker(sheet.layout(), sheet.picture(0));
  EXPECT_EQ(tracker.first().rows.size(), sheet.markers.size());
  double early = 0, late = 0;
  constexpr int kFrames = 100;
  for (int frame = 1; frame <= kFrames; ++frame) {
    const TextureFrame found = tracker.next(sheet.picture(frame));
    EXPECT_EQ(found.rows.size(), sheet.markers.size()) << frame;
    const double rms_px = sheet.rms_px(found, frame);
    EXPECT_LT(rms_px, 0.06);
    (frame <= kFrames / 2 ? early : late) += rms_px;
  }
  EXPECT_LT(late, 1.2 * early);
}

TEST(TextureTracker, ReportsCoveredMarkersMissingAndFindsThemAgain) {
  const DrawnSheet sheet;
  TextureTracker tracker(sheet.layout(), sheet.picture(0));
  for (int frame = 1; frame <= 6; ++frame) {
    SCOPED_TRACE(frame);
    cv::Mat picture = sheet.picture(frame);
    const bool covered = frame >= 2 && frame <= 4;
    if (covered) cv::rectangle(picture, cv::Rect(0, 0, 78, 78), 100, cv::FILLED);
    const TextureFrame found = tracker.next(picture);
    EXPECT_LT(sheet.rms_px(found, frame), 0.06);
    std::map<int, const char*> missing(found.missing.begin(), found.missing.end());
    EXPECT_EQ(found.rows.size() + missing.size(), sheet.markers.size());
    if (!covered) {
      EXPECT_TRUE(missing.empty());
      continue;
    }
    for (const int marker : {0, 1, kAcross, kAcross + 1}) {
      const Eigen::Vector2d place =
          DrawnSheet::place_at(sheet.places[static_cast<size_t>(marker)].pixel_px, frame);
      if (place.maxCoeff() > 70) continue;  // partly seen
      ASSERT_TRUE(missing.contains(marker));
      EXPECT_STREQ(missing[marker], texture_missing::kCovered);
    }
  }
}

TEST(TextureTracker, SaysWhatLeavesThePictureOrIsTooDark) {
  const DrawnSheet sheet;
  TextureTracker tracker(sheet.layout(), sheet.picture(0));
  cv::Mat moved = cv::Mat::zeros(kSheetPicture, CV_8UC1);
  cv::Mat picture = sheet.picture(0);
  constexpr int kLeft_px = 14;
  for (int step = 1; step <= 3; ++step)
    picture(
        cv::Rect(kLeft_px * step, 0, kSheetPicture.width - kLeft_px * step, kSheetPicture.height))
        .copyTo(moved(cv::Rect(0, 0, kSheetPicture.width - kLeft_px * step, kSheetPicture.height))),
        tracker.next(moved);
  const TextureFrame found = tracker.next(moved);
  std::map<int, const char*> missing(found.missing.begin(), found.missing.end());
  ASSERT_TRUE(missing.contains(0));  // its place is at 0
  EXPECT_STREQ(missing[0], texture_missing::kOutside);

  TextureTracker other(sheet.layout(), sheet.picture(0));
  cv::Mat shaded = sheet.picture(1);
  shaded(cv::Rect(0, 0, kSheetPicture.width, 76)) *= 0.02;
  const TextureFrame dark = other.next(shaded);
  EXPECT_LT(sheet.rms_px(dark, 1), 0.1);
  missing = {dark.missing.begin(), dark.missing.end()};
  ASSERT_TRUE(missing.contains(1));
  EXPECT_STREQ(missing[1], texture_missing::kDark);
}

TEST(TextureTracker, FollowsThroughChangesOfLight) {
  const DrawnSheet sheet;
  TextureTracker tracker(sheet.layout(), sheet.picture(0));
  for (int frame = 1; frame <= 5; ++frame) {
    const TextureFrame found = tracker.next(sheet.picture(frame, 1.5, 1 - 0.12 * frame));
    EXPECT_EQ(found.rows.size(), sheet.markers.size());
    EXPECT_LT(sheet.rms_px(found, frame), 0.08);
  }
}

TEST(TextureTracker, DoesNotDependOnTheNumberOfThreads) {
  const DrawnSheet sheet;
  std::vector<TextureFrame> last;
  for (const size_t threads : {1, 2}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    TextureTracker tracker(sheet.layout(), sheet.picture(0));
    tracker.next(sheet.picture(1));
    last.push_back(tracker.next(sheet.picture(2)));
  }
  ASSERT_EQ(last[0].rows.size(), last[1].rows.size());
  for (size_t i = 0; i < last[0].rows.size(); ++i) {
    EXPECT_EQ(last[0].rows[i].pixel_px, last[1].rows[i].pixel_px);
    EXPECT_EQ(last[0].rows[i].sigma_px, last[1].rows[i].sigma_px);
  }
}

TEST(TextureTracker, CallsMarkersWithoutTexturePlain) {
  const DrawnSheet sheet;
  cv::Mat picture = sheet.picture(0, 0);
  cv::rectangle(picture, cv::Rect(0, 0, 78, 78), 100, cv::FILLED);
  const TextureTracker tracker(sheet.layout(), picture);
  const TextureFrame first = tracker.first();
  ASSERT_FALSE(first.missing.empty());
  EXPECT_EQ(first.missing[0].first, 0);
  EXPECT_STREQ(first.missing[0].second, texture_missing::kPlain);
}

TEST(TextureTracker, RefusesOptionsOutOfRange) {
  EXPECT_THROW(TextureTrackOptions{.fine_blur_px = 0}.validate(), InputError);
  EXPECT_THROW(TextureTrackOptions{.most_radius_px = 3}.validate(), InputError);
  EXPECT_THROW(TextureTrackOptions{.least_explained = 1}.validate(), InputError);
}

}  // namespace
}  // namespace clothfit
