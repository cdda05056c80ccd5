#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "calib/camera/rigid3.h"
#include "data/camera_parameters.h"

namespace clothfit {

/// Returns the pixel of a point in camera axes (x right, y down, z forward; metres). Pixel (0, 0)
/// is the centre of the top left pixel. This is the one projection function of the program: `Real`
/// is double, ceres::Jet or another number type. `intrinsics` holds fx, fy, cx, cy and then the
/// `distortion_count` coefficients of `model`. Points with z <= 0 have no pixel: the caller checks.
///
///   x = X / Z,  y = Y / Z,  r2 = x2 + y2,  pixel = (fx x' + cx, fy y' + cy)
///   pinhole:        x' = x,  y' = y
///   brown_conrady:  x' = x (1 + k1 r2 + k2 r4 + k3 r6) / (1 + k4 r2 + k5 r4 + k6 r6)
///                        + 2 p1 x y + p2 (r2 + 2 x2)
///                   y' = y (the same ratio) + p1 (r2 + 2 y2) + 2 p2 x y
///                   OpenCV's order k1 k2 p1 p2 k3 k4 k5 k6 [brown1971, opencv]
///   kannala_brandt: (x', y') = (x, y) theta_d / r,  theta = atan r,
///                   theta_d = theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8)
///                   [kannala2006]
template <class Real>
Eigen::Matrix<Real, 2, 1> project(CameraModel model, const Real* intrinsics, int distortion_count,
                                  const Eigen::Matrix<Real, 3, 1>& point_in_camera);

/// fx, fy, cx, cy and up to 8 distortion coefficients.
inline constexpr int kMaxIntrinsics = 12;

/// Returns a camera's intrinsics in the order that the projection above takes; unused places are 0.
std::array<double, kMaxIntrinsics> intrinsics_of(const CameraParameters& camera);

/// Projects with a camera's parameters; nothing where the point lies behind the camera.
std::optional<Eigen::Vector2d> project(const CameraParameters& camera,
                                       const Eigen::Vector3d& point_in_camera);

/// Projects and gives the derivative of the pixel by the point (2 x 3, px/m), exact to rounding.
std::optional<Eigen::Vector2d> project(const CameraParameters& camera,
                                       const Eigen::Vector3d& point_in_camera,
                                       Eigen::Matrix<double, 2, 3>* pixel_by_point);

/// Returns the unit direction (camera axes) seen at a pixel; nothing where no direction projects
/// there. The distortion is inverted by Newton's method, walking out from the image centre, so that
/// a distortion that folds back is never inverted on its far side.
std::optional<Eigen::Vector3d> unproject(const CameraParameters& camera,
                                         const Eigen::Vector2d& pixel);

/// Returns the pose as a transform. The camera must have one.
Rigid3 camera_from_world(const CameraParameters& camera);

}  // namespace clothfit

#include "calib/camera/projection_impl.h"
