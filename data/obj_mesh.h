#pragma once

#include <Eigen/Core>
#include <filesystem>

namespace clothfit {

/// A surface of triangles: an obstacle, a body.
struct SurfaceMesh {
  Eigen::Matrix3Xd vertex_m;
  /// Indices of vertices, 0 the first, counterclockwise as seen from outside.
  Eigen::Matrix3Xi triangle;
};

/// Reads the vertices and faces of a Wavefront OBJ file: `v x y z`, metres, world axes; `f a b c
/// ...`. Everything else in it (normals, texture, groups, materials) is passed over. Faces with
/// more than three corners are cut into triangles from their first corner, which must see all of
/// the face. Indices count from 1; negative ones count backwards from the last vertex so far.
///
/// Throws InputError for a missing file, for no face or none with an area, for a number that is
/// none or farther than any scene, and for an index of no vertex.
SurfaceMesh read_obj(const std::filesystem::path& file);

/// Says whether a triangle has an area.
bool has_area(const SurfaceMesh& mesh);

/// Writes a Wavefront OBJ file that read_obj reads back to the last bit.
void write_obj(const SurfaceMesh& mesh, const std::filesystem::path& file);

}  // namespace clothfit
