// Checks faults that pictures show and no file states: combs, copies, darkness.

#include "vision/ingest/footage_watch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

namespace clothfit {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

/// What is drawn: bars that move to the right, over lines that stand still.
struct Scene {
  double speed_px = 6;  ///< per picture
  double noise = 0;     ///< grey levels
  bool lines = false;   ///< fine horizontal ones that do not move
};

cv::Mat draw(const Scene& scene, double picture, cv::RNG& random) {
  cv::Mat grey(120, 160, CV_8UC1, cv::Scalar(200));
  if (scene.lines)
    for (int y = 0; y < grey.rows; y += 2) grey.row(y).setTo(150);
  for (int bar = 0; bar < 3; ++bar) {
    const int left = static_cast<int>(10 + 50 * bar + scene.speed_px * picture) % 150;
    grey(cv::Rect(left, 20, 9, 60)).setTo(40);
  }
  cv::GaussianBlur(grey, grey, {}, scene.lines ? 0.1 : 0.6);
  if (scene.noise > 0) {
    cv::Mat noise(grey.size(), CV_16SC1), sum;
    random.fill(noise, cv::RNG::NORMAL, 0, scene.noise);
    grey.convertTo(sum, CV_16S);
    cv::Mat(sum + noise).convertTo(grey, CV_8U);
  }
  return grey;
}

/// Watches pictures whose odd lines show half a picture later where they are `interlaced`.
FootageWatch watched(const Scene& scene, bool interlaced) {
  cv::RNG random(46);
  FootageWatch watch;
  for (int p = 0; p < 12; ++p) {
    cv::Mat grey = draw(scene, p, random);
    const cv::Mat later = draw(scene, p + 0.5, random);
    for (int y = 1; interlaced && y < grey.rows; y += 2) later.row(y).copyTo(grey.row(y));
    watch.see(grey, p);
  }
  return watch;
}

TEST(FootageWatch, SeesCombsOfInterlacedPictures) {
  for (const double noise : {0.0, 3.0, 8.0})
    for (const double speed_px : {4.0, 12.0})
      EXPECT_TRUE(watched({.speed_px = speed_px, .noise = noise}, true).interlaced())
          << noise << " " << speed_px << ": " << watched({speed_px, noise}, true).combing();
}

TEST(FootageWatch, SeesNoneInProgressivePictures) {
  for (const double noise : {0.0, 3.0, 8.0, 20.0})
    for (const bool lines : {false, true}) {
      const Scene scene{.speed_px = 6, .noise = noise, .lines = lines};
      EXPECT_FALSE(watched(scene, false).interlaced())
          << noise << " " << lines << ": " << watched(scene, false).combing();
    }
}

TEST(FootageWatch, NamesPicturesThatRepeatInMotionAndNoneAtRest) {
  cv::RNG random(46);
  FootageWatch watch;
  // At rest for three, then moving with copies at 6 and 7, then at rest to the end.
  int frame = 0;
  for (const double time : {0, 0, 0, 1, 2, 3, 3, 3, 4, 5, 5, 5})
    watch.see(draw({}, time, random), frame++);
  const Findings findings = watch.findings("folder");
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_THAT(findings[0].found,
              HasSubstr("2 of 12 pictures repeat the one before: frames 6 to 7"));
}

TEST(FootageWatch, NamesPicturesThatAreNearlyBlack) {
  cv::RNG random(46);
  FootageWatch watch;
  for (int p = 0; p < 5; ++p) {
    cv::Mat grey = draw({.noise = 1}, p, random);
    if (p == 3) {
      grey *= 0.04;
      grey.at<uchar>(5, 5) = 255;  // a hot pixel
    }
    watch.see(grey, p);
  }
  const Findings findings = watch.findings("folder");
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_THAT(findings[0].found,
              HasSubstr("1 of 5 pictures are nearly black, with levels up to 8"));
  EXPECT_THAT(findings[0].found, HasSubstr("frames 3"));
}

TEST(FootageWatch, SaysNothingOfSoundFootage) {
  EXPECT_THAT(watched({.noise = 2}, false).findings("folder"), IsEmpty());
}

TEST(FootageWatch, TakesPicturesThatACodecRepeatsAtRestForNoCopies) {
  cv::RNG random(46);
  FootageWatch watch;
  const cv::Mat still = draw({}, 0, random);
  for (int frame = 0; frame < 12; ++frame) {
    cv::Mat grey = still.clone();
    grey.at<uchar>(4, 4 + frame / 3) = 128;  // what a codec refines now and then
    watch.see(grey, frame);
  }
  EXPECT_THAT(watch.findings("folder"), IsEmpty());
}

}  // namespace
}  // namespace clothfit
