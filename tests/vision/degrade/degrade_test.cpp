// Checks that pictures are spoiled as said: places, lengths, shares, seeds. What detectors make of
// them is for `clothfit study vision`.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <opencv2/imgproc.hpp>
#include <random>

#include "vision/degrade/brightness.h"
#include "vision/degrade/displacement_field.h"
#include "vision/degrade/h264.h"
#include "vision/degrade/h264_video.h"
#include "vision/degrade/hand.h"
#include "vision/degrade/motion_blur.h"
#include "vision/degrade/shrink.h"
#include "vision/ingest/open_images.h"

namespace clothfit {
namespace {

/// A soft spot of light; its moments tell place and blur.
cv::Mat spot(double u, double v) {
  cv::Mat picture(61, 61, CV_8UC1);
  for (int row = 0; row < picture.rows; ++row)
    for (int column = 0; column < picture.cols; ++column)
      picture.at<std::uint8_t>(row, column) = static_cast<std::uint8_t>(
          std::lround(240 * std::exp(-0.125 * (std::pow(column - u, 2) + std::pow(row - v, 2)))));
  return picture;
}

struct Moments {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
};

Moments moments(const cv::Mat& picture) {
  const cv::Moments m = cv::moments(picture);
  Moments result{.mean = {m.m10 / m.m00, m.m01 / m.m00}};
  result.covariance << m.mu20 / m.m00, m.mu11 / m.m00, m.mu11 / m.m00, m.mu02 / m.m00;
  return result;
}

TEST(MotionBlur, SpreadsASpotAlongItsMotionAndLeavesItsPlace) {
  const cv::Mat sharp = spot(30.3, 29.6);
  const double length = 7, direction = 0.6;

  const Moments after = moments(blur_straight(sharp, direction, length));

  const Moments before = moments(sharp);
  const Eigen::Vector2d along(std::cos(direction), std::sin(direction));
  EXPECT_LT((after.mean - before.mean).norm(), 0.02);
  const Eigen::Matrix2d added = after.covariance - before.covariance;
  EXPECT_NEAR(along.dot(added * along), length * length / 12, 0.25);  // 8-bit rounding of the tails
  EXPECT_NEAR(added.trace(), length * length / 12, 0.35);
}

TEST(DisplacementField, HasThePointsOwnMotionsAtTheirPlaces) {
  const std::vector<PointMotion> points = {{{20, 20}, {3, 0}}, {{80, 60}, {0, -2}}};

  const cv::Mat field = displacement_field(scaled_to_median(points, 6), cv::Size(100, 80));

  // The median of two is the longer one: the motions are doubled.
  EXPECT_NEAR(field.at<cv::Vec2f>(20, 20)[0], 6, 0.05);
  EXPECT_NEAR(field.at<cv::Vec2f>(60, 80)[1], -4, 0.05);
}

TEST(Hand, CoversTheShareOfPointsThatItShould) {
  std::vector<Eigen::Vector2d> points;
  for (int i = 0; i < 256; ++i) points.emplace_back(100 + 12 * (i % 16), 80 + 12 * (i / 16));
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    SCOPED_TRACE(seed);

    const Hand hand = hand_over(points, 0.25, seed);

    int covered = 0;
    for (const Eigen::Vector2d& point : points) covered += hand.cover(point) > 0.5;
    EXPECT_NEAR(covered, 64, 8);
  }
}

TEST(Hand, HidesThePictureWhereItSaysAndNowhereElse) {
  const cv::Mat picture(200, 200, CV_8UC1, cv::Scalar(10));
  const Hand hand{.palm_px = {100, 100}, .direction_rad = 0.3, .size_px = 20};

  const cv::Mat covered = with_hand(picture, hand, 5);

  EXPECT_GT(covered.at<std::uint8_t>(100, 100), 60);
  for (int v = 0; v < 200; ++v)
    for (int u = 0; u < 200; ++u)
      if (hand.cover({u, v}) == 0) {
        ASSERT_EQ(covered.at<std::uint8_t>(v, u), 10);
      }
}

TEST(Brightness, ScalesLevelsAndAddsTheNoiseOfItsSeed) {
  const cv::Mat picture(100, 100, CV_8UC1, cv::Scalar(200));

  const cv::Mat dark = with_brightness(picture, 0.15, 3, 7);

  cv::Scalar mean, deviation;
  cv::meanStdDev(dark, mean, deviation);
  EXPECT_NEAR(mean[0], 30, 0.15);  // 10 000 draws
  EXPECT_NEAR(deviation[0], std::hypot(3, std::sqrt(1.0 / 12)), 0.1);
  EXPECT_EQ(cv::norm(dark, with_brightness(picture, 0.15, 3, 7)), 0);
  EXPECT_GT(cv::norm(dark, with_brightness(picture, 0.15, 3, 8)), 0);
}

TEST(Shrink, PutsPlacesWhereItSays) {
  const cv::Mat large = spot(35.2, 22.7);

  const cv::Mat small = shrunk(large, 0.5);

  const Moments after = moments(small);
  EXPECT_NEAR(after.mean.x(), shrunk_place(35.2, large.cols, small.cols), 0.03);
  EXPECT_NEAR(after.mean.y(), shrunk_place(22.7, large.rows, small.rows), 0.03);
}

TEST(H264, LosesMoreAtAHigherRateFactorAndKeepsOrderAndSize) {
  std::vector<cv::Mat> pictures;
  for (int i = 0; i < 4; ++i)
    pictures.push_back(with_brightness(spot(20 + 4 * i, 30), 1, 3, static_cast<std::uint64_t>(i)));

  const std::vector<cv::Mat> fine = through_h264(pictures, 18), coarse = through_h264(pictures, 40);

  ASSERT_EQ(fine.size(), pictures.size());
  for (size_t i = 0; i < pictures.size(); ++i) {
    ASSERT_EQ(fine[i].size(), pictures[i].size());
    EXPECT_LT(cv::norm(fine[i], pictures[i]), cv::norm(coarse[i], pictures[i]));
    EXPECT_NEAR(moments(cv::Mat(fine[i] > 100)).mean.x(), 20 + 4 * static_cast<double>(i), 0.5);
  }
}

TEST(H264Video, HoldsTheTimesOfItsPicturesAndWhatTheCodecLeavesOfThem) {
  std::vector<cv::Mat> pictures;
  std::vector<double> times_s;
  for (const int frame : {0, 1, 3, 4, 8, 9}) {
    pictures.push_back(spot(20 + 2 * frame, 30));
    times_s.push_back(frame / 60.0);
  }
  const std::filesystem::path file =
      std::filesystem::path(testing::TempDir()) / "h264_video_test.mp4";

  write_h264_video(pictures, times_s, 18, file);

  const auto video = open_images(file);
  const std::vector<double> read_s = video->times_s();
  ASSERT_EQ(read_s.size(), times_s.size());
  cv::Mat grey;
  for (size_t i = 0; i < pictures.size(); ++i) {
    EXPECT_NEAR(read_s[i], times_s[i], 1e-9);  // 1/60 s is 1500 ticks
    ASSERT_TRUE(video->next(grey));
    EXPECT_NEAR(moments(cv::Mat(grey > 100)).mean.x(), moments(cv::Mat(pictures[i] > 100)).mean.x(),
                0.5);
  }
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace clothfit
