#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "data/finding.h"
#include "data/obj_mesh.h"
#include "model/topology/mesh.h"

namespace clothfit {

/// Returns the volume that a surface encloses, m3: negative where its faces point inwards. Nothing
/// where it is not closed.
std::optional<double> enclosed_volume_m3(const SurfaceMesh& surface);

/// Returns how deep points (m, world; 3 x n) lie behind a surface, m: 0 on its free side, and
/// beyond the border of one that is not closed.
std::vector<double> depth_behind_m(const SurfaceMesh& surface, const Eigen::Matrix3Xd& point_m);

/// Returns the second smallest side of the box around the thinnest part of a surface, m: the width
/// of a post or a rod. A part is what is joined by shared places. Nothing without a face.
std::optional<double> narrowest_part_m(const SurfaceMesh& surface);

/// Returns the first frame in which an edge of the surface goes through a cell of the cloth, or
/// nothing. `position_m` holds the vertices of the mesh in every frame.
std::optional<int> frame_pierced(const SurfaceMesh& surface, const Mesh& mesh,
                                 const std::vector<Eigen::Matrix3Xd>& position_m);

/// Holds an obstacle against the cloth that is to touch it, where that starts (3 x points, world):
/// whether its faces point to the cloth, whether the cloth starts in it by more than the noise of
/// the points, whether it is narrower than a cell of the mesh. `where` names the surface's file.
Findings check_obstacle(const SurfaceMesh& surface, const std::string& where, const Mesh& mesh,
                        const Eigen::Matrix3Xd& start_m, double noise_m = 0);

/// Says that the cloth went through the obstacle in a run (frame_pierced); nothing where it did
/// not.
std::optional<Finding> check_pierced(const SurfaceMesh& surface, const std::string& where,
                                     const Mesh& mesh,
                                     const std::vector<Eigen::Matrix3Xd>& position_m);

}  // namespace clothfit
