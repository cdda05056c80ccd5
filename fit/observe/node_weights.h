#pragma once

#include <Eigen/Core>

#include "model/topology/mesh.h"

namespace clothfit {

/// Values at points of a cloth (2 x points: s, t in m) from those at nodes x nodes nodes spread
/// evenly over it, by the natural bicubic spline through them (model/topology/surface.h): points x
/// nodes^2, a smooth field of few numbers.
Eigen::MatrixXd node_weights(const Mesh& mesh, int nodes, const Eigen::Matrix2Xd& points);

}  // namespace clothfit
