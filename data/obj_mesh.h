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

/// Reads the vertices (`v x y z`, metres, world axes) and faces (`f a b c ...`) of a Wavefront OBJ
/// file; everything else in it (normals, texture, groups, materials) is passed over. Faces with
/// more than three corners are cut into triangles from their first corner, which must see all of
/// the face. Indices count from 1, or backwards from the last vertex so far where they are
/// negative.
///
/// Throws InputError: no file, no face or none with an area, a number that is none or farther than
/// any scene, an index of no vertex.
SurfaceMesh read_obj(const std::filesystem::path& file);

/// Writes a Wavefront OBJ file that read_obj reads back to the last bit.
void write_obj(const SurfaceMesh& mesh, const std::filesystem::path& file);

}  // namespace clothfit
