#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace clothfit {

/// Returns the Delaunay triangulation of points in the plane in which every edge of `kept` is an
/// edge of triangles. `point_m`: 2 x points; `kept`: pairs of their indices, which may share ends
/// but not cross, nor pass through other points. It fills the points' convex hull; a triangle's
/// corners run counterclockwise. Four points on a circle, as a lattice has them, are cut along
/// either diagonal.
///
/// The points are rounded to a grid of 2^29 steps over their extent, and the arithmetic on that
/// grid is exact. Throws InputError, with the points' places, where two fall together, where fewer
/// than three make no triangle, and where kept edges cross. Source: the dual of the Voronoi diagram
/// [boost.polygon]; missing edges come in by flips [sloan1993].
std::vector<std::array<int, 3>> delaunay_triangles(
    const Eigen::Matrix2Xd& point_m, const std::vector<std::array<int, 2>>& kept = {});

}  // namespace clothfit
