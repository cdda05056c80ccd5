#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

#include "vision/detect/tag_pattern.h"

namespace clothfit {

/// A pixel that shows a tag.
struct TagSample {
  int u = 0, v = 0;
  double x = 0, y = 0;  ///< tag coordinates by the homography
  double grey = 0;
};

/// Returns the pixels that show a tag and most of the cell of white around it, row by row.
/// `pixel_from_tag` maps tag coordinates to pixels.
std::vector<TagSample> tag_samples(const cv::Mat& grey, const TagPattern& pattern,
                                   const Eigen::Matrix3d& pixel_from_tag);

/// Thins out samples that say little. Those at which the picture is flatter than 0.03 of the
/// steepest slope tell only the light, and one in four of them stays; of a large tag's samples 4000
/// stay in all. `slope` has one entry per sample.
void thin_out(std::vector<TagSample>& samples, const Eigen::VectorXd& slope);

/// Returns where a homography maps a point.
Eigen::Vector2d mapped(const Eigen::Matrix3d& homography, const Eigen::Vector2d& point);

}  // namespace clothfit
