#pragma once

#include <Eigen/Core>

namespace clothfit {

/// Map of second degree from places around a marker in the first picture to another picture:
///
///   W(d) = place + linear d + second (dx^2 / 2, dx dy, dy^2 / 2),  d: px from the marker
struct PatchWarp {
  Eigen::Vector2d place_px = Eigen::Vector2d::Zero();    ///< of the marker itself
  Eigen::Matrix2d linear = Eigen::Matrix2d::Identity();  ///< px per px
  Eigen::Matrix<double, 2, 3> second = Eigen::Matrix<double, 2, 3>::Zero();  ///< 1/px

  Eigen::Vector2d at(const Eigen::Vector2d& from_marker_px) const {
    const double x = from_marker_px.x(), y = from_marker_px.y();
    return place_px + linear * from_marker_px +
           second * Eigen::Vector3d(0.5 * x * x, x * y, 0.5 * y * y);
  }
  /// Returns the derivative of `at`.
  Eigen::Matrix2d jacobian(const Eigen::Vector2d& from_marker_px) const {
    const double x = from_marker_px.x(), y = from_marker_px.y();
    Eigen::Matrix2d result = linear;
    result.col(0) += x * second.col(0) + y * second.col(1);
    result.col(1) += x * second.col(1) + y * second.col(2);
    return result;
  }
};

}  // namespace clothfit
