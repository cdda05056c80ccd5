#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <vector>

namespace clothfit {

/// A moving cloth for programs of computer graphics: faces, and the positions of their vertices in
/// every frame.
struct MeshSequence {
  /// Corners of each face, counterclockwise around the outward normal; the last is -1 in triangles.
  Eigen::Matrix4Xi face;
  /// Texture coordinates (u, v) of the vertices, 2 x vertices, 0 to 1.
  Eigen::Matrix2Xd texture;
  std::vector<double> time_s;                ///< rising, of each frame
  std::vector<Eigen::Matrix3Xd> position_m;  ///< of each frame: 3 x vertices, world, finite
  Eigen::Vector3d up{0, 0, 1};               ///< against gravity; unit
};

/// Returns a grid's faces and texture, without frames. Vertex [i, j] (row i along t, column j along
/// s) has index i * columns + j; there are two or more of both. Its cells run counterclockwise
/// around the outward normal of the printed side: t x s, towards a viewer for whom s runs to the
/// right and t down. u runs along s, v against t, so that a picture of the printed side lies
/// upright.
MeshSequence grid_sequence(int columns, int rows);

/// Writes a Wavefront OBJ of one frame. It has vertices in metres and the world's axes, texture
/// coordinates and faces. Numbers read back to the last bit. Throws InputError where the file
/// cannot be written.
void write_obj(const MeshSequence& mesh, int frame, const std::filesystem::path& file);

/// Writes a Point Cache 2 file, all little-endian: "POINTCACHE2" and a zero byte; version 1, number
/// of points (int32); first frame 0, frames per sample 1 (float32); number of samples (int32); then
/// x, y, z of every point, sample by sample (float32). Positions are as in the OBJ files, whose
/// vertices the cache moves. It holds frames, not seconds. Throws InputError where the file cannot
/// be written.
void write_pc2(const MeshSequence& mesh, const std::filesystem::path& file);

/// Writes glTF 2.0 in one binary file (.glb): an animated mesh, metres, turned so that `up` is +Y.
/// Times are seconds from the first frame.
///
/// Frames are morph targets, displacements from the first one. The animation blends from each to
/// the next, so that no more than two weigh at any time: a viewer need support no more than that.
/// After kMostMorphTargets frames a new mesh takes over, shown by its node's scale, because
/// graphics processors limit how many targets a mesh may have and because weights are stored for
/// each frame and target. Normals are left to the viewer: they would be wrong between frames.
/// Throws InputError where the file cannot be written or would exceed the 4 GiB of the format.
void write_glb(const MeshSequence& mesh, const std::filesystem::path& file);
inline constexpr int kMostMorphTargets = 128;

}  // namespace clothfit
