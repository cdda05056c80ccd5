#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <span>
#include <vector>

namespace clothfit {

/// A point of a picture and how far it moves while the shutter is open.
struct PointMotion {
  Eigen::Vector2d at_px = Eigen::Vector2d::Zero();      ///< in the middle of the exposure
  Eigen::Vector2d motion_px = Eigen::Vector2d::Zero();  ///< from the exposure's begin to its end
};

/// Interpolates the motion of points over a picture: CV_32FC2 of that size, px. Each pixel has the
/// mean of all points, weighed by distance^-4, so that a point's own place has its own motion. No
/// points give no motion.
cv::Mat displacement_field(std::span<const PointMotion> points, const cv::Size& size);

/// Returns `points` with motions scaled to a median length. Motions that are all zero stay so.
std::vector<PointMotion> scaled_to_median(std::span<const PointMotion> points, double median_px);

}  // namespace clothfit
