#pragma once

#include <ceres/solver.h>

#include <Eigen/Core>
#include <array>
#include <limits>
#include <optional>
#include <vector>

#include "calib/bundle/placed_pixel.h"
#include "calib/camera/projection.h"
#include "calib/camera/rigid3.h"
#include "data/camera_parameters.h"

namespace clothfit {

// These functions find the camera's pose from points whose places are taken as exact. They are
// inside calib/ only, the base of place_sheet and of the start of place_world.

/// The camera with its numbers in the order that project() takes.
struct FixedCamera {
  CameraModel model;
  std::array<double, kMaxIntrinsics> intrinsics;
  int distortion_count;

  explicit FixedCamera(const CameraParameters& camera)
      : model(camera.model),
        intrinsics(intrinsics_of(camera)),
        distortion_count(static_cast<int>(camera.distortion.size())) {}

  /// Computes (projected - observed) / sigma; returns false behind the camera.
  template <class Real>
  bool residual(const Eigen::Matrix<Real, 3, 1>& in_camera, const PlacedPixel& observed,
                Real* out) const {
    if (!(in_camera[2] > Real(0.0))) return false;
    std::array<Real, kMaxIntrinsics> numbers;
    for (size_t i = 0; i < numbers.size(); ++i) numbers[i] = Real(intrinsics[i]);
    const Eigen::Matrix<Real, 2, 1> pixel =
        project<Real>(model, numbers.data(), distortion_count, in_camera);
    out[0] = (pixel[0] - observed.pixel_px.x()) / observed.sigma_px;
    out[1] = (pixel[1] - observed.pixel_px.y()) / observed.sigma_px;
    return true;
  }
};

/// Returns options for problems of a few dozen unknowns, solved to the limits of rounding.
ceres::Solver::Options solver_options();

/// Returns residuals of points taken as exact, in sigmas; infinite behind the camera.
std::vector<Eigen::Vector2d> standardised_residuals(const FixedCamera& camera,
                                                    const std::vector<PlacedPixel>& pixels,
                                                    const Rigid3& camera_from_world);

/// Returns the robust standard deviation per coordinate.
double robust_spread(const std::vector<Eigen::Vector2d>& residuals);

/// Moves `camera_from_world` to the least squares of the pixels marked `used`. A `cauchy_scale` of
/// 0 stands for no robust loss.
bool refine_pose(const FixedCamera& camera, const std::vector<PlacedPixel>& pixels,
                 const std::vector<char>& used, double cauchy_scale, Rigid3& camera_from_world);

/// A pose refined with gross errors held off, and the robust spread of its residuals (in sigmas).
struct RobustPose {
  Rigid3 camera_from_world;
  double spread = std::numeric_limits<double>::infinity();
  double cost = std::numeric_limits<double>::infinity();
};

RobustPose refine_pose_robustly(const FixedCamera& camera, const std::vector<PlacedPixel>& pixels,
                                const Rigid3& start);

/// Returns where the rays through the pixels meet the plane z = 1 in front of the camera; nothing
/// where a pixel has no ray.
std::optional<std::vector<Eigen::Vector2d>> on_image_plane(const CameraParameters& camera,
                                                           const std::vector<PlacedPixel>& pixels);

/// Says whether all numbers are finite and all sigmas > 0.
bool is_finite(const std::vector<PlacedPixel>& pixels);

}  // namespace clothfit
