#pragma once

#include <filesystem>

#include "data/obj_mesh.h"

namespace clothfit {

/// Reads the vertices and faces of a PLY file, text or binary of either byte order: element
/// `vertex` with properties x, y and z, metres, world axes; element `face` with the list
/// vertex_indices (or vertex_index). Other elements and properties are passed over. Faces with more
/// than three corners are cut into triangles as those of read_obj().
///
/// Throws InputError for a missing file, a damaged header, content that ends too early, and as
/// read_obj() does.
SurfaceMesh read_ply(const std::filesystem::path& file);

/// Writes a binary PLY file, little-endian, that read_ply reads back to the last bit.
void write_ply(const SurfaceMesh& mesh, const std::filesystem::path& file);

/// Reads a surface: PLY where the file's name ends in `.ply` or `.ply.gz`, in upper case too, else
/// OBJ.
SurfaceMesh read_surface(const std::filesystem::path& file);

}  // namespace clothfit
