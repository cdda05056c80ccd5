#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "data/camera_parameters.h"

namespace clothfit {

/// Gives the line of sight of every place of a camera's picture. `unproject`
/// (calib/camera/projection.h) finds one by Newton's method, which is too slow for millions. Here
/// it is computed once per camera at nodes some pixels apart, and interpolated cubically between
/// them. Where the interpolation is off by more than 1e-4 px, measured in the middle between nodes,
/// `unproject` is called for every place.
class CameraRays {
 public:
  /// Covers the picture and `margin_px` (>= 0) around it. The camera is copied.
  explicit CameraRays(const CameraParameters& camera, int margin_px = 8);

  const CameraParameters& camera() const { return camera_; }
  int margin_px() const { return margin_px_; }

  /// Gives directions (x, y, 1) in camera axes at the pixels (u, v_px) of one row. x is NaN where
  /// no direction projects there. Pixels lie within the picture's outer edge and the margin, or up
  /// to one to the right of it and below. `direction` has as many entries as `u_px`.
  void row(std::span<const double> u_px, double v_px, std::span<Eigen::Vector2d> direction) const;

 private:
  int margin_px_ = 0;
  CameraParameters camera_;
  int node_columns_ = 0;
  int node_rows_ = 0;
  std::vector<Eigen::Vector2d> nodes_;  ///< (x, y) on the plane z = 1, row by row
  std::vector<bool> smooth_;            ///< per cell between nodes: interpolation is good enough
};

}  // namespace clothfit
