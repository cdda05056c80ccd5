#pragma once

#include <Eigen/Core>

#include "model/topology/mesh.h"

namespace clothfit {

/// Maps values at nodes x nodes nodes spread evenly over a cloth to those at points: points x
/// nodes^2. Points are 2 x points: s, t in m. The map is the natural bicubic spline through the
/// nodes (model/topology/surface.h), a smooth field of few numbers.
Eigen::MatrixXd node_weights(const Mesh& mesh, int nodes, const Eigen::Matrix2Xd& points);

}  // namespace clothfit
