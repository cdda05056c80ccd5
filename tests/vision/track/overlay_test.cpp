// Checks colours and places of the drawing. That the right points are drawn is in track_test.cpp.

#include "vision/track/overlay.h"

#include <gtest/gtest.h>

namespace clothfit {
namespace {

TEST(Overlay, DrawsGoodGreenRejectedRedAndReferenceBlue) {
  using Kind = OverlayPoint::Kind;
  const cv::Mat grey(60, 100, CV_8UC1, cv::Scalar(90));

  const cv::Mat picture = draw_overlay(grey, {{Kind::good, {20, 30}, ""},
                                              {Kind::rejected, {50, 30}, ""},
                                              {Kind::reference, {80, 30}, ""},
                                              {Kind::good, {500, -3}, "outside"}});

  ASSERT_EQ(picture.type(), CV_8UC3);
  ASSERT_EQ(picture.size(), grey.size());
  const auto strongest = [&](int u) {
    const cv::Vec3b bgr = picture.at<cv::Vec3b>(30, u);
    return std::max_element(bgr.val, bgr.val + 3) - bgr.val;
  };
  EXPECT_EQ(strongest(20), 1);
  EXPECT_EQ(strongest(50), 2);
  EXPECT_EQ(strongest(80), 0);
  EXPECT_EQ(picture.at<cv::Vec3b>(5, 5), cv::Vec3b(90, 90, 90));
}

}  // namespace
}  // namespace clothfit
