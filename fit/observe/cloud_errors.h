#pragma once

#include <Eigen/Core>
#include <span>

#include "data/clouds.h"
#include "data/fit_result.h"
#include "model/topology/mesh.h"

namespace clothfit {

/// Returns the mean squared distance (m²) from each point of one set to the nearest of another, 3 x
/// n, neither empty.
double mean_square_to_nearest_m2(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to);

/// Returns the Chamfer distance (m²) of two sets of points, 3 x n, neither empty. It adds the mean
/// squared distances from each point to the nearest of the other set, there and back.
/// Reconstructions of cloth from one camera are judged by it [kairanda2022].
double chamfer_distance_m2(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b);

/// Compares the model's surface with measured clouds (world, m). Each frame's cloud is compared
/// with as many points of the bicubic surface, drawn evenly over the flat cloth. `position_m`: 3 x
/// vertices of `mesh`, for each frame. Clouds of other frames are left out.
CloudErrors cloud_errors(const PointClouds& clouds, const Mesh& mesh,
                         std::span<const Eigen::Matrix3Xd> position_m, int first_held_out);

}  // namespace clothfit
