#include "vision/texture/smooth_picture.h"

#include <cassert>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "data/parallel.h"

namespace clothfit {
namespace {

/// Weights of four values around a place, and their derivatives.
struct CubicWeights {
  Eigen::Vector4f value, slope;

  /// `x`, 0 to 1, is the way from the second value to the third.
  explicit CubicWeights(float x) {
    const float y = 1 - x, x2 = x * x, y2 = y * y;
    value = Eigen::Vector4f(y2 * y, 3 * x2 * x - 6 * x2 + 4, 3 * y2 * y - 6 * y2 + 4, x2 * x) / 6;
    slope = 0.5F * Eigen::Vector4f(-y2, 3 * x2 - 4 * x, -3 * y2 + 4 * y, x2);
  }
};

/// Turns values `stride` apart into the weights of the cubic B-splines that run through them, by
/// the recursive filter of [unser1999] with its first value as if the row went on evenly.
void to_spline_weights(float* value, int count, std::ptrdiff_t stride) {
  const float pole = std::sqrt(3.0F) - 2;
  const auto at = [&](int i) -> float& { return value[i * stride]; };
  constexpr float kGain = 6;
  at(0) *= kGain / (1 - pole);
  for (int i = 1; i < count; ++i) at(i) = kGain * at(i) + pole * at(i - 1);
  at(count - 1) *= -pole / (1 - pole);
  for (int i = count - 2; i >= 0; --i) at(i) = pole * (at(i + 1) - at(i));
}

}  // namespace

SmoothPicture::SmoothPicture(const cv::Mat& grey, double blur_px) {
  assert(grey.type() == CV_8UC1 && blur_px > 0);
  grey.convertTo(weights_, CV_32F);
  cv::GaussianBlur(weights_, weights_, cv::Size(), blur_px, blur_px, cv::BORDER_REPLICATE);
  for_each_index(static_cast<size_t>(weights_.rows), [&](size_t row) {
    to_spline_weights(weights_.ptr<float>(static_cast<int>(row)), weights_.cols, 1);
  });
  const auto stride = static_cast<std::ptrdiff_t>(weights_.step1());
  for_each_index(static_cast<size_t>(weights_.cols), [&](size_t column) {
    to_spline_weights(weights_.ptr<float>(0) + column, weights_.rows, stride);
  });
}

PictureSample SmoothPicture::at(const Eigen::Vector2f& at) const {
  assert(covers(at));
  const int u = static_cast<int>(at.x()), v = static_cast<int>(at.y());
  const CubicWeights across(at.x() - static_cast<float>(u)), down(at.y() - static_cast<float>(v));
  Eigen::Vector4f row_value, row_slope;
  for (int r = 0; r < 4; ++r) {
    const Eigen::Map<const Eigen::Vector4f> four(weights_.ptr<float>(v - 1 + r) + u - 1);
    row_value[r] = across.value.dot(four);
    row_slope[r] = across.slope.dot(four);
  }
  return {.level = down.value.dot(row_value),
          .slope = {down.value.dot(row_slope), down.slope.dot(row_value)}};
}

}  // namespace clothfit
