#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace clothfit {

enum class CameraModel { pinhole, brown_conrady, kannala_brandt };

/// The place of a camera: x_camera = rotation * x_world + translation_m.
struct CameraPose {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation_m = Eigen::Vector3d::Zero();
  /// Covariance of (rotation vector (rad), translation (m)), both added on the camera's side:
  /// camera_from_world = (exp(w), d) * estimate. Absent where it is not known.
  std::optional<Eigen::Matrix<double, 6, 6>> covariance;
};

/// The content of a camera file (formats: clothfit-camera/1). Camera axes: x right, y down, z
/// forward; pixel (0, 0) is the centre of the top left pixel, as in OpenCV.
struct CameraParameters {
  std::string name;
  CameraModel model = CameraModel::pinhole;
  int image_width = 0;   ///< px, > 0
  int image_height = 0;  ///< px, > 0
  Eigen::Vector2d focal_px = Eigen::Vector2d::Zero();
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  /// brown_conrady: k1 k2 p1 p2 [k3 [k4 k5 k6]] in OpenCV's order and meaning; kannala_brandt: 4;
  /// pinhole: none.
  std::vector<double> distortion;
  std::optional<CameraPose> camera_from_world;
  double readout_time_s = 0;  ///< from the first to the last row (rolling shutter)
};

/// Reads and checks a camera file. Throws InputError.
CameraParameters read_camera(const std::filesystem::path& file);

/// Writes a camera file that read_camera reads back to the last bit.
void write_camera(const CameraParameters& camera, const std::filesystem::path& file);

}  // namespace clothfit
