#pragma once

#include <Eigen/Core>
#include <array>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "vision/detect/tag_pattern.h"

namespace clothfit {

/// The part of a picture around a tag. A large tag is shrunk by averaging whole pixels, which keeps
/// nearly all that its edges tell.
struct TagWindow {
  cv::Mat levels;             ///< CV_32FC1, grey levels
  int shrunk_by = 1;          ///< pixels averaged along each axis
  Eigen::Vector2d origin_px;  ///< of window pixel (0, 0) in the picture

  Eigen::Vector2d to_picture(const Eigen::Vector2d& window_px) const {
    return origin_px + shrunk_by * window_px;
  }
  /// Returns a homography to the window for one to the picture.
  Eigen::Matrix3d from_picture(const Eigen::Matrix3d& pixel_from_tag) const;
};

/// Cuts the window of a tag that reaches to +-`reach` in tag coordinates; nothing where the picture
/// does not show any of it. `grey` is CV_8UC1.
std::optional<TagWindow> tag_window(const cv::Mat& grey, const Eigen::Matrix3d& pixel_from_tag,
                                    double reach);

/// Where samples reach to, in tag coordinates. Outside the border only a cell of quiet zone is
/// known, so the blur of its surroundings must stay out.
double sample_reach(const TagPattern& pattern);

/// The pixels of a window that show a tag and most of the cell of white around it, row by row. Rows
/// of zeros fill them up to a multiple of kTogether.
struct TagSamples {
  static constexpr Eigen::Index kTogether = 64;

  Eigen::Index count = 0;     ///< without the filling
  Eigen::ArrayXf x, y;        ///< tag coordinates by the homography
  Eigen::ArrayXf grey;        ///< levels
  std::vector<int> u, v;      ///< pixels in the smallest box that holds all of them
  int width = 0, height = 0;  ///< of the box
};

/// Returns the samples of a tag. `pixel_from_tag` maps tag coordinates to pixels of the window.
TagSamples tag_samples(const TagWindow& window, const TagPattern& pattern,
                       const Eigen::Matrix3d& pixel_from_tag);

/// Returns the corners of the border in tag coordinates, in the order of TagDetection.
const std::array<Eigen::Vector2d, 4>& border_corners();

/// Returns where a homography maps a point.
Eigen::Vector2d mapped(const Eigen::Matrix3d& homography, const Eigen::Vector2d& point);

}  // namespace clothfit
