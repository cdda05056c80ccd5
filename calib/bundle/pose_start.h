#pragma once

// Private to calib/: closed-form poses to start a refinement from.

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "calib/camera/rigid3.h"

namespace clothfit {

/// Finds the poses (camera from plane) of a flat figure seen by an ideal camera. `on_plane_m` are
/// points of the plane z = 0, `on_image` their images on z = 1. A flat figure far away looks nearly
/// the same under two poses; both are returned, the better first [collins2014]. Gross outliers,
/// which miss the best homography by more than `tolerance` (0: none are looked for), take no part.
/// Empty when the points do not determine a pose.
std::vector<Rigid3> plane_poses(const std::vector<Eigen::Vector2d>& on_plane_m,
                                const std::vector<Eigen::Vector2d>& on_image, double tolerance = 0);

/// Finds the pose (camera from world) of points in space, at least 4, flat or not [terzakis2020].
std::optional<Rigid3> point_pose(const std::vector<Eigen::Vector3d>& in_world_m,
                                 const std::vector<Eigen::Vector2d>& on_image);

/// Returns the indices of the points that follow one homography from plane to image within
/// `tolerance` (units of `image`).
std::vector<int> homography_inliers(const std::vector<Eigen::Vector2d>& on_plane_m,
                                    const std::vector<Eigen::Vector2d>& image, double tolerance);

}  // namespace clothfit
