#pragma once

#include <functional>

#include "model/topology/obstacle.h"

namespace clothfit {

/// Returns the surface on which `field` is 0, as triangles that face where it is positive: one
/// vertex in every cell of a grid that the surface passes [gibson1998], moved onto it along the
/// field's gradient. The field is smooth, its slope about 1, and positive on the sides of the box
/// from `low_m` to `high_m`. What is thinner than a cell may be lost.
TriangleMesh zero_surface(const std::function<double(const Eigen::Vector3d&)>& field,
                          const Eigen::Vector3d& low_m, const Eigen::Vector3d& high_m,
                          double cell_m);

}  // namespace clothfit
