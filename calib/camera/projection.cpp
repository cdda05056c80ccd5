#include "calib/camera/projection.h"

#include <Eigen/LU>
#include <algorithm>
#include <cassert>
#include <unsupported/Eigen/AutoDiff>

namespace clothfit {

std::array<double, kMaxIntrinsics> intrinsics_of(const CameraParameters& camera) {
  assert(camera.distortion.size() <= kMaxIntrinsics - 4);
  std::array<double, kMaxIntrinsics> intrinsics{camera.focal_px.x(), camera.focal_px.y(),
                                                camera.centre_px.x(), camera.centre_px.y()};
  std::copy(camera.distortion.begin(), camera.distortion.end(), intrinsics.begin() + 4);
  return intrinsics;
}

std::optional<Eigen::Vector2d> project(const CameraParameters& camera,
                                       const Eigen::Vector3d& point_in_camera) {
  if (!(point_in_camera.z() > 0)) return std::nullopt;
  const auto intrinsics = intrinsics_of(camera);
  return project<double>(camera.model, intrinsics.data(),
                         static_cast<int>(camera.distortion.size()), point_in_camera);
}

std::optional<Eigen::Vector2d> project(const CameraParameters& camera,
                                       const Eigen::Vector3d& point_in_camera,
                                       Eigen::Matrix<double, 2, 3>* pixel_by_point) {
  if (pixel_by_point == nullptr) return project(camera, point_in_camera);
  if (!(point_in_camera.z() > 0)) return std::nullopt;

  using Dual = Eigen::AutoDiffScalar<Eigen::Vector3d>;
  const auto values = intrinsics_of(camera);
  std::array<Dual, kMaxIntrinsics> intrinsics;
  for (size_t i = 0; i < values.size(); ++i)
    intrinsics[i] = Dual(values[i], Eigen::Vector3d::Zero());
  Eigen::Matrix<Dual, 3, 1> point;
  for (int axis = 0; axis < 3; ++axis) point[axis] = Dual(point_in_camera[axis], 3, axis);

  const Eigen::Matrix<Dual, 2, 1> pixel = project<Dual>(
      camera.model, intrinsics.data(), static_cast<int>(camera.distortion.size()), point);
  pixel_by_point->row(0) = pixel[0].derivatives().transpose();
  pixel_by_point->row(1) = pixel[1].derivatives().transpose();
  return Eigen::Vector2d(pixel[0].value(), pixel[1].value());
}

std::optional<Eigen::Vector3d> unproject(const CameraParameters& camera,
                                         const Eigen::Vector2d& pixel) {
  constexpr int kStepsOut = 16;     // Newton follows the inverse along the way from the centre
  constexpr int kNewtonSteps = 20;  // at most, at each; quadratic convergence needs 3 or 4
  constexpr double kTolerancePx = 1e-10;
  constexpr double kTightestFold = 1e-6;  // of the undistorted area per pixel

  const double undistorted_area = camera.focal_px.x() * camera.focal_px.y();
  const Eigen::Vector2d from_centre = pixel - camera.centre_px;
  const double rounding_px = 1e-14 * (pixel.norm() + camera.centre_px.norm());
  Eigen::Vector3d direction(0, 0, 1);
  for (int step = 1; step <= kStepsOut; ++step) {
    const Eigen::Vector2d target =
        camera.centre_px + from_centre * (static_cast<double>(step) / kStepsOut);
    bool converged = false;
    for (int iteration = 0; iteration < kNewtonSteps && !converged; ++iteration) {
      Eigen::Matrix<double, 2, 3> pixel_by_point;
      const auto projected = project(camera, direction, &pixel_by_point);
      const Eigen::Matrix2d jacobian = pixel_by_point.leftCols<2>();  // on the plane z = 1
      if (!(jacobian.determinant() > kTightestFold * undistorted_area)) return std::nullopt;
      const Eigen::Vector2d error_px = *projected - target;
      converged = error_px.norm() < kTolerancePx + rounding_px;
      direction.head<2>() -= jacobian.inverse() * error_px;
    }
    if (!converged) return std::nullopt;
  }
  return direction.normalized();
}

Rigid3 camera_from_world(const CameraParameters& camera) {
  assert(camera.camera_from_world.has_value());
  return {camera.camera_from_world->rotation, camera.camera_from_world->translation_m};
}

}  // namespace clothfit
