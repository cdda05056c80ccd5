#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <filesystem>
#include <vector>

namespace clothfit {

/// The measured motion of a rigid body: x_world = rotation * x_body + position_m. Times are of the
/// body's own clock and rise.
struct BodyPath {
  std::vector<double> time_s;
  std::vector<Eigen::Vector3d> position_m;
  std::vector<Eigen::Quaterniond> rotation;  ///< unit
};

/// Reads the file of a RigidBody (columns time,x,y,z,qw,qx,qy,qz). Throws InputError.
BodyPath read_body_path(const std::filesystem::path& file);

}  // namespace clothfit
