#pragma once

#include <opencv2/core.hpp>

namespace clothfit {

/// Blurs an 8-bit grey picture as the motion of what it shows would. A point that moves by d while
/// the shutter is open appears as the mean over its places from -d/2 to d/2 around its own, so that
/// its mean place stays. `field_px` is d for every pixel (displacement_field.h), CV_32FC2.
cv::Mat blur_along(const cv::Mat& grey, const cv::Mat& field_px);

/// Blurs by one motion of the whole picture: `length_px` (>= 0) at `direction_rad`, from u to v.
cv::Mat blur_straight(const cv::Mat& grey, double direction_rad, double length_px);

}  // namespace clothfit
