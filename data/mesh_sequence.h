#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <vector>

namespace clothfit {

/// A moving cloth for programs of computer graphics: a grid of vertices and its positions in every
/// frame. Vertex [i, j] (row i along t, column j along s) has index i * columns + j.
struct MeshSequence {
  int columns = 0;                           ///< >= 2
  int rows = 0;                              ///< >= 2
  std::vector<double> time_s;                ///< rising, of each frame
  std::vector<Eigen::Matrix3Xd> position_m;  ///< of each frame: 3 x vertices, world, finite
  Eigen::Vector3d up{0, 0, 1};               ///< against gravity; unit
};

/// Returns the cells of the grid, four vertices each: 4 x cells. They run counter-clockwise around
/// the outward normal of the printed side: t x s, towards a viewer for whom s runs to the right and
/// t down.
Eigen::Matrix4Xi quads(const MeshSequence& mesh);

/// Returns texture coordinates (u, v) of the vertices: 2 x vertices. u runs along s, v against t,
/// both from 0 to 1, so that a picture of the printed side lies upright.
Eigen::Matrix2Xd texture_coordinates(const MeshSequence& mesh);

/// Writes a Wavefront OBJ of one frame. It has vertices in metres and the world's axes, texture
/// coordinates and quads. Numbers read back to the last bit. Throws InputError where the file
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
