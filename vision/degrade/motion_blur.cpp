#include "vision/degrade/motion_blur.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

namespace clothfit {
namespace {

/// Weighs four neighbours at a share (0 to 1) between the inner two: cubic, exact for parabolas.
std::array<float, 4> cubic_weights(float share) {
  const float rest = 1 - share;
  return {-0.5F * share * rest * rest, 1 + share * share * (1.5F * share - 2.5F),
          1 + rest * rest * (1.5F * rest - 2.5F), -0.5F * rest * share * share};
}

/// Returns the grey level between pixels; the border's pixels go on beyond it.
float grey_at(const cv::Mat& grey, float u, float v) {
  const int left = static_cast<int>(std::floor(u)), top = static_cast<int>(std::floor(v));
  const std::array<float, 4> across = cubic_weights(u - static_cast<float>(left));
  const std::array<float, 4> down = cubic_weights(v - static_cast<float>(top));
  float sum = 0;
  for (int j = 0; j < 4; ++j) {
    const std::uint8_t* row = grey.ptr<std::uint8_t>(std::clamp(top - 1 + j, 0, grey.rows - 1));
    float row_sum = 0;
    for (int i = 0; i < 4; ++i)
      row_sum += across[static_cast<size_t>(i)] *
                 static_cast<float>(row[std::clamp(left - 1 + i, 0, grey.cols - 1)]);
    sum += down[static_cast<size_t>(j)] * row_sum;
  }
  return sum;
}

/// Returns the motion at the pixel next to a place.
cv::Vec2f motion_at_pixel(const cv::Mat& field_px, float u, float v) {
  return field_px.at<cv::Vec2f>(std::clamp(static_cast<int>(std::lround(v)), 0, field_px.rows - 1),
                                std::clamp(static_cast<int>(std::lround(u)), 0, field_px.cols - 1));
}

/// Returns the mean level that a pixel sees while the shutter is open.
float blurred_level(const cv::Mat& grey, const cv::Mat& field_px, int u, int v) {
  const cv::Vec2f here = field_px.at<cv::Vec2f>(v, u);
  // Instants are closer than the half pixel that any lens spreads a point over.
  constexpr float kSpacing = 0.4F;  // px
  const int instants = 1 + static_cast<int>(std::hypot(here[0], here[1]) / kSpacing);
  float sum = 0;
  for (int i = 0; i < instants; ++i) {
    const float share = (static_cast<float>(i) + 0.5F) / static_cast<float>(instants) - 0.5F;
    // What the pixel sees then is x with x + share d(x) = pixel, by one round of iteration.
    const cv::Vec2f there = motion_at_pixel(field_px, static_cast<float>(u) - share * here[0],
                                            static_cast<float>(v) - share * here[1]);
    sum += grey_at(grey, static_cast<float>(u) - share * there[0],
                   static_cast<float>(v) - share * there[1]);
  }
  return sum / static_cast<float>(instants);
}

}  // namespace

cv::Mat blur_along(const cv::Mat& grey, const cv::Mat& field_px) {
  assert(grey.type() == CV_8UC1 && field_px.type() == CV_32FC2 && grey.size() == field_px.size());
  cv::Mat blurred(grey.size(), CV_8UC1);
  for (int v = 0; v < grey.rows; ++v)
    for (int u = 0; u < grey.cols; ++u)
      blurred.at<std::uint8_t>(v, u) = static_cast<std::uint8_t>(
          std::clamp(std::lround(blurred_level(grey, field_px, u, v)), 0L, 255L));
  return blurred;
}

cv::Mat blur_straight(const cv::Mat& grey, double direction_rad, double length_px) {
  const cv::Scalar motion(length_px * std::cos(direction_rad), length_px * std::sin(direction_rad));
  return blur_along(grey, cv::Mat(grey.size(), CV_32FC2, motion));
}

}  // namespace clothfit
