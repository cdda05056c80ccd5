#pragma once

#include <Eigen/Core>

namespace clothfit {

/// A point known in some frame, and its pixel.
struct PlacedPixel {
  Eigen::Vector3d point_m = Eigen::Vector3d::Zero();
  Eigen::Vector2d pixel_px = Eigen::Vector2d::Zero();
  double sigma_px = 1;  ///< per coordinate, > 0
  /// The four corners of one printed tag share a group, in any order; -1: none. Groups of another
  /// number of points, or whose survey is far from a square, count as points without a group.
  int group = -1;
};

}  // namespace clothfit
