#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "data/obj_mesh.h"
#include "model/topology/mesh.h"

namespace clothfit {

/// Returns the volume that a surface encloses, m3: negative where its faces point inwards. Nothing
/// where it is not closed.
std::optional<double> enclosed_volume_m3(const SurfaceMesh& surface);

/// Returns which points (m, world; 3 x n) lie inside a closed surface, whatever way its faces
/// point.
std::vector<bool> inside(const SurfaceMesh& surface, const Eigen::Matrix3Xd& point_m);

/// Returns the second smallest side of the box around the thinnest part of a surface, m: the width
/// of a post or a rod. A part is what is joined by shared places. Nothing without a face.
std::optional<double> narrowest_part_m(const SurfaceMesh& surface);

/// Returns the first frame in which an edge of the surface goes through a cell of the cloth, or
/// nothing. `position_m` holds the vertices of the mesh in every frame.
std::optional<int> frame_pierced(const SurfaceMesh& surface, const Mesh& mesh,
                                 const std::vector<Eigen::Matrix3Xd>& position_m);

/// Returns the largest side of a cell of the flat mesh, m.
double largest_cell_m(const Mesh& mesh);

}  // namespace clothfit
