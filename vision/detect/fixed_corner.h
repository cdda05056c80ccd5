#pragma once

#include <Eigen/Core>
#include <vector>

namespace clothfit {

struct FixedCorner {
  Eigen::Vector2d pixel_px = Eigen::Vector2d::Zero();
  double sigma_px = 0;  ///< one standard deviation per coordinate
  int frames = 0;       ///< detections that took part
};

/// Averages the detections (one or more, with their sigmas) of a corner that does not move. Only
/// the scatter from frame to frame averages out. Ragged edges and the pixel grid are the same in
/// every picture of a fixed tag, so the detections' own sigma stays.
FixedCorner average_fixed_corner(const std::vector<Eigen::Vector2d>& pixels,
                                 const std::vector<double>& sigmas);

}  // namespace clothfit
