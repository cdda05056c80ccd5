#pragma once

#include <Eigen/Core>
#include <span>

#include "data/clouds.h"
#include "data/fit_result.h"
#include "model/topology/mesh.h"

namespace clothfit {

/// Chamfer distance (m²) of two sets of points, 3 x n, neither empty: the mean squared distance
/// from each point to the nearest of the other set, there and back, added. It is what
/// reconstructions of cloth from one camera are judged by [kairanda2022].
double chamfer_distance_m2(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b);

/// How far the model's surface is from measured clouds (world, m): each frame's is compared with as
/// many points of the bicubic surface, drawn evenly over the flat cloth. `position_m`: 3 x vertices
/// of `mesh`, of each frame. Clouds of other frames say nothing.
CloudErrors cloud_errors(const PointClouds& clouds, const Mesh& mesh,
                         std::span<const Eigen::Matrix3Xd> position_m, int first_held_out);

}  // namespace clothfit
