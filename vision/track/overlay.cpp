#include "vision/track/overlay.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace clothfit {
namespace {

cv::Scalar colour_bgr(OverlayPoint::Kind kind) {
  switch (kind) {
    case OverlayPoint::Kind::good:
      return {60, 200, 0};
    case OverlayPoint::Kind::rejected:
      return {40, 40, 235};
    case OverlayPoint::Kind::reference:
      return {235, 120, 20};
  }
  return {};
}

}  // namespace

cv::Mat draw_overlay(const cv::Mat& grey, const std::vector<OverlayPoint>& points) {
  assert(grey.type() == CV_8UC1);
  cv::Mat picture;
  cv::cvtColor(grey, picture, cv::COLOR_GRAY2BGR);

  // Crosses are drawn to a sixteenth of a pixel, to show where within a pixel the point lies.
  constexpr int kFractionBits = 4;
  constexpr double kFraction = 1 << kFractionBits;
  const int arm_px = std::max(3, static_cast<int>(std::lround(0.004 * grey.cols)));
  const double text_scale = std::max(0.3, 0.0003 * grey.cols);
  const cv::Rect2d inside(0, 0, grey.cols, grey.rows);
  for (const OverlayPoint& point : points) {
    if (!inside.contains({point.pixel_px.x(), point.pixel_px.y()})) continue;
    const auto at = [&](double dx, double dy) {
      return cv::Point(static_cast<int>(std::lround((point.pixel_px.x() + dx) * kFraction)),
                       static_cast<int>(std::lround((point.pixel_px.y() + dy) * kFraction)));
    };
    const cv::Scalar colour = colour_bgr(point.kind);
    cv::line(picture, at(-arm_px, 0), at(arm_px, 0), colour, 1, cv::LINE_AA, kFractionBits);
    cv::line(picture, at(0, -arm_px), at(0, arm_px), colour, 1, cv::LINE_AA, kFractionBits);
    if (point.label.empty()) continue;
    const cv::Point beside(static_cast<int>(point.pixel_px.x()) + arm_px + 1,
                           static_cast<int>(point.pixel_px.y()) - 1);
    cv::putText(picture, point.label, beside, cv::FONT_HERSHEY_SIMPLEX, text_scale, colour, 1,
                cv::LINE_AA);
  }
  return picture;
}

}  // namespace clothfit
