#include "vision/degrade/displacement_field.h"

#include <opencv2/imgproc.hpp>
#include <vector>

#include "data/median.h"

namespace clothfit {
namespace {

/// Returns the weighted mean motion of all points at a place.
cv::Vec2f motion_at(std::span<const PointMotion> points, const Eigen::Vector2d& place) {
  constexpr double kOwn = 0.25;  // px^2; keeps the weight of a point's own place finite
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double weights = 0;
  for (const PointMotion& point : points) {
    const double square = (point.at_px - place).squaredNorm() + kOwn;
    const double weight = 1 / (square * square);
    sum += weight * point.motion_px;
    weights += weight;
  }
  if (weights > 0) sum /= weights;
  return {static_cast<float>(sum.x()), static_cast<float>(sum.y())};
}

}  // namespace

cv::Mat displacement_field(std::span<const PointMotion> points, const cv::Size& size) {
  // A field between markers is smooth: it is evaluated on a grid, and linear between its nodes.
  constexpr int kStep = 4;  // px
  const cv::Size nodes((size.width + kStep - 1) / kStep + 1, (size.height + kStep - 1) / kStep + 1);
  cv::Mat coarse(nodes, CV_32FC2);
  for (int row = 0; row < nodes.height; ++row)
    for (int column = 0; column < nodes.width; ++column)
      coarse.at<cv::Vec2f>(row, column) = motion_at(points, kStep * Eigen::Vector2d(column, row));
  const cv::Matx23d node_from_pixel(1.0 / kStep, 0, 0, 0, 1.0 / kStep, 0);
  cv::Mat field;
  cv::warpAffine(coarse, field, node_from_pixel, size, cv::INTER_LINEAR | cv::WARP_INVERSE_MAP,
                 cv::BORDER_REPLICATE);
  return field;
}

std::vector<PointMotion> scaled_to_median(std::span<const PointMotion> points, double median_px) {
  std::vector<PointMotion> scaled(points.begin(), points.end());
  std::vector<double> lengths;
  for (const PointMotion& point : points) lengths.push_back(point.motion_px.norm());
  if (lengths.empty()) return scaled;
  const double now = median(std::move(lengths));
  if (!(now > 0)) return scaled;
  for (PointMotion& point : scaled) point.motion_px *= median_px / now;
  return scaled;
}

}  // namespace clothfit
