#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace clothfit {

/// A point to draw on a picture.
struct OverlayPoint {
  enum class Kind { good, rejected, reference };
  Kind kind = Kind::good;
  Eigen::Vector2d pixel_px = Eigen::Vector2d::Zero();
  std::string label;  ///< reason of a rejection or a short name; may be empty
};

/// Draws the grey picture in colour (8-bit BGR) with crosses on points. Good points have green
/// ones, rejected points red ones with their reason, reference points blue ones. Points outside the
/// picture are left out. The size of the crosses grows with the picture's.
cv::Mat draw_overlay(const cv::Mat& grey, const std::vector<OverlayPoint>& points);

}  // namespace clothfit
