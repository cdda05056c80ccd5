#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>

namespace clothfit {

/// Level and slope of a picture at a place.
struct PictureSample {
  float level = 0;                                  ///< grey levels
  Eigen::Vector2f slope = Eigen::Vector2f::Zero();  ///< grey levels per px, along u and v
};

/// A picture blurred by a Gaussian, with values between its pixels by the cubic B-spline through
/// them [unser1999] and their exact derivatives. The blur keeps the interpolation's error small:
/// noise that is interpolated loses variance between pixels, which would draw places towards there.
class SmoothPicture {
 public:
  SmoothPicture() = default;
  /// Takes an 8-bit grey picture; `blur_px` > 0.
  SmoothPicture(const cv::Mat& grey, double blur_px);

  int columns() const { return weights_.cols; }
  int rows() const { return weights_.rows; }
  /// Says whether `at` has a value: a place at least 1 px within the outer pixels' centres.
  bool covers(const Eigen::Vector2f& at) const {
    return at.x() >= 1 && at.y() >= 1 && at.x() < static_cast<float>(weights_.cols - 2) &&
           at.y() < static_cast<float>(weights_.rows - 2);
  }
  /// Returns the sample at a place that it covers.
  PictureSample at(const Eigen::Vector2f& at) const;

 private:
  cv::Mat weights_;  ///< of the B-splines around the pixels, CV_32FC1
};

}  // namespace clothfit
