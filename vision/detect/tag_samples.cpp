#include "vision/detect/tag_samples.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace clothfit {
namespace {

constexpr double kFar_px = 1e6;  // beyond any picture

Eigen::AlignedBox2d box_of(const Eigen::Matrix3d& pixel_from_tag, double reach) {
  Eigen::AlignedBox2d box;
  for (const double x : {-reach, reach})
    for (const double y : {-reach, reach}) box.extend(mapped(pixel_from_tag, {x, y}));
  return box;
}

double longest_side(const Eigen::Matrix3d& pixel_from_tag, double reach) {
  const auto corner = [&](double x, double y) {
    return mapped(pixel_from_tag, {reach * x, reach * y});
  };
  return std::max({(corner(1, 1) - corner(-1, 1)).norm(), (corner(1, -1) - corner(-1, -1)).norm(),
                   (corner(1, 1) - corner(1, -1)).norm(), (corner(-1, 1) - corner(-1, -1)).norm()});
}

/// A sample before it is moved into the arrays.
struct Sample {
  float x, y, grey;
  int u, v;
};

TagSamples to_arrays(const std::vector<Sample>& list) {
  TagSamples samples;
  if (list.empty()) return samples;
  const auto [left, right] = std::ranges::minmax(list, {}, &Sample::u);
  samples.count = static_cast<Eigen::Index>(list.size());
  samples.width = right.u - left.u + 1;
  samples.height = list.back().v - list.front().v + 1;
  constexpr Eigen::Index kTogether = TagSamples::kTogether;
  const Eigen::Index size = (samples.count + kTogether - 1) / kTogether * kTogether;
  for (Eigen::ArrayXf* one : {&samples.x, &samples.y, &samples.grey}) one->setZero(size);
  for (size_t i = 0; i < list.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    samples.x[row] = list[i].x;
    samples.y[row] = list[i].y;
    samples.grey[row] = list[i].grey;
    samples.u.push_back(list[i].u - left.u);
    samples.v.push_back(list[i].v - list.front().v);
  }
  return samples;
}

}  // namespace

const std::array<Eigen::Vector2d, 4>& border_corners() {
  static const std::array<Eigen::Vector2d, 4> corners = {{{-1, 1}, {1, 1}, {1, -1}, {-1, -1}}};
  return corners;
}

Eigen::Vector2d mapped(const Eigen::Matrix3d& homography, const Eigen::Vector2d& point) {
  return (homography * point.homogeneous()).hnormalized();
}

Eigen::Matrix3d TagWindow::from_picture(const Eigen::Matrix3d& pixel_from_tag) const {
  Eigen::Matrix3d window_from_picture = Eigen::Matrix3d::Identity();
  window_from_picture.topRightCorner<2, 1>() = -origin_px;
  window_from_picture.topRows<2>() /= shrunk_by;
  return window_from_picture * pixel_from_tag;
}

std::optional<TagWindow> tag_window(const cv::Mat& grey, const Eigen::Matrix3d& pixel_from_tag,
                                    double reach) {
  const Eigen::AlignedBox2d box = box_of(pixel_from_tag, reach);
  if (!box.sizes().allFinite()) return {};
  // Larger sides cost time and tell little more.
  constexpr double kMostSide_px = 80;
  TagWindow window;
  window.shrunk_by = std::max(
      1, static_cast<int>(
             std::ceil(std::min(longest_side(pixel_from_tag, reach), kFar_px) / kMostSide_px)));
  const Eigen::Vector2d size(grey.cols, grey.rows);
  const Eigen::Vector2d first = box.min().cwiseMax(0).cwiseMin(size);
  const Eigen::Vector2d past = (box.max().array() + 1).matrix().cwiseMax(0).cwiseMin(size);
  cv::Rect rect(cv::Point(static_cast<int>(first.x()), static_cast<int>(first.y())),
                cv::Point(static_cast<int>(past.x()), static_cast<int>(past.y())));
  rect.width -= rect.width % window.shrunk_by;
  rect.height -= rect.height % window.shrunk_by;
  if (rect.empty()) return {};
  grey(rect).convertTo(window.levels, CV_32F);
  if (window.shrunk_by > 1)
    cv::resize(window.levels, window.levels, rect.size() / window.shrunk_by, 0, 0, cv::INTER_AREA);
  window.origin_px = Eigen::Vector2d(rect.x, rect.y).array() + 0.5 * (window.shrunk_by - 1);
  return window;
}

double sample_reach(const TagPattern& pattern) {
  return 1 + 0.75 * pattern.cell();
}

TagSamples tag_samples(const TagWindow& window, const TagPattern& pattern,
                       const Eigen::Matrix3d& pixel_from_tag) {
  const double reach = sample_reach(pattern);
  const Eigen::AlignedBox2d box = box_of(pixel_from_tag, reach);
  const auto begin = [](double least) {
    return static_cast<int>(std::ceil(std::clamp(least, 0.0, kFar_px)));
  };
  const auto end = [](double most, int size) {
    return static_cast<int>(std::floor(std::clamp(most, -1.0, size - 1.0)));
  };
  const int u_begin = begin(box.min().x()), u_end = end(box.max().x(), window.levels.cols);
  const int v_begin = begin(box.min().y()), v_end = end(box.max().y(), window.levels.rows);
  const Eigen::Matrix3d tag_from_pixel = pixel_from_tag.inverse();
  std::vector<Sample> list;
  for (int v = v_begin; v <= v_end; ++v) {
    const float* row = window.levels.ptr<float>(v);
    const Eigen::Vector3d first = tag_from_pixel * Eigen::Vector3d(0, v, 1);
    for (int u = u_begin; u <= u_end; ++u) {
      const Eigen::Vector2d q = (first + u * tag_from_pixel.col(0)).hnormalized();
      if (q.cwiseAbs().maxCoeff() > reach) continue;
      list.push_back({.x = static_cast<float>(q.x()),
                      .y = static_cast<float>(q.y()),
                      .grey = row[u],
                      .u = u,
                      .v = v});
    }
  }
  return to_arrays(list);
}

}  // namespace clothfit
