#include "vision/detect/tag_samples.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace clothfit {

Eigen::Vector2d mapped(const Eigen::Matrix3d& homography, const Eigen::Vector2d& point) {
  return (homography * point.homogeneous()).hnormalized();
}

std::vector<TagSample> tag_samples(const cv::Mat& grey, const TagPattern& pattern,
                                   const Eigen::Matrix3d& pixel_from_tag) {
  // Outside the border only a cell of quiet zone is known, so the blur of its surroundings must
  // stay out.
  const double reach = 1 + 0.75 * pattern.cell();
  Eigen::AlignedBox2d box;
  for (const double x : {-reach, reach})
    for (const double y : {-reach, reach}) box.extend(mapped(pixel_from_tag, {x, y}));
  const int u_begin = std::max(0, static_cast<int>(std::ceil(box.min().x())));
  const int v_begin = std::max(0, static_cast<int>(std::ceil(box.min().y())));
  const int u_end = std::min(grey.cols - 1, static_cast<int>(std::floor(box.max().x())));
  const int v_end = std::min(grey.rows - 1, static_cast<int>(std::floor(box.max().y())));
  const Eigen::Matrix3d tag_from_pixel = pixel_from_tag.inverse();
  std::vector<TagSample> samples;
  for (int v = v_begin; v <= v_end; ++v) {
    const std::uint8_t* row = grey.ptr<std::uint8_t>(v);
    for (int u = u_begin; u <= u_end; ++u) {
      const Eigen::Vector2d q = mapped(tag_from_pixel, Eigen::Vector2d(u, v));
      if (q.cwiseAbs().maxCoeff() > reach) continue;
      samples.push_back(
          {.u = u, .v = v, .x = q.x(), .y = q.y(), .grey = static_cast<double>(row[u])});
    }
  }
  return samples;
}

void thin_out(std::vector<TagSample>& samples, const Eigen::VectorXd& slope) {
  constexpr size_t kEnough = 4000;
  const double flat = 0.03 * slope.maxCoeff();
  std::vector<TagSample> kept;
  for (size_t i = 0; i < samples.size(); ++i) {
    const bool tells = slope[static_cast<Eigen::Index>(i)] > flat;
    if (tells || (samples[i].u + 2 * samples[i].v) % 4 == 0) kept.push_back(samples[i]);
  }
  const size_t stride = (kept.size() + kEnough - 1) / kEnough;
  samples.clear();
  for (size_t i = 0; i < kept.size(); i += stride) samples.push_back(kept[i]);
}

}  // namespace clothfit
