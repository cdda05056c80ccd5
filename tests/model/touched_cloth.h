#pragma once

#include <memory>
#include <string>
#include <vector>

#include "tests/model/random_cloth.h"

namespace clothfit {

/// Makes a hilly ground of triangles, 1.4 m on a side, about z = 0. Tops and hollows are 4 cm apart
/// in height, so that points below it are nearest to faces, edges and corners.
inline TriangleMesh hilly_ground() {
  constexpr int kSide = 8;
  TriangleMesh mesh{Eigen::Matrix3Xd(3, kSide * kSide),
                    Eigen::Matrix3Xi(3, 2 * (kSide - 1) * (kSide - 1))};
  Eigen::Index t = 0;
  for (int i = 0; i < kSide; ++i) {
    for (int j = 0; j < kSide; ++j) {
      const int v = i * kSide + j;
      mesh.vertex_m.col(v) << -0.5 + 0.2 * j, -0.5 + 0.2 * i,
          0.02 * ((i * 7 + j * 3) % 5 - 2) / 2.0;
      if (i + 1 == kSide || j + 1 == kSide) continue;
      mesh.triangle.col(t++) << v, v + 1, v + kSide + 1;
      mesh.triangle.col(t++) << v, v + kSide + 1, v + kSide;
    }
  }
  return mesh;
}

/// Makes a cloth with whatever else an effect may act on.
inline Cloth touched_cloth(int vertices_per_side) {
  Cloth cloth = square_cloth(vertices_per_side);
  cloth.obstacle = std::make_shared<const Obstacle>(hilly_ground());
  return cloth;
}

/// Returns two points of the cloth that drift, each its own way, from their places in the flat
/// cloth. They serve effects that act on driven points.
inline std::vector<HeldVertexWeights> drifting_points(const Mesh& mesh) {
  std::vector<HeldVertexWeights> held = {held_at(mesh, 0, 0), held_at(mesh, 0.31, 0.02)};
  held[0].motion = [](double time_s) { return Eigen::Vector3d(0.05 * time_s, 0.02 * time_s, 0); };
  held[1].motion = [](double time_s) {
    return Eigen::Vector3d(0.31 - 0.1 * time_s, 0.02, 0.03 * time_s);
  };
  return held;
}

/// Returns the flat cloth folded in two along t, layers `gap_m` apart.
inline Eigen::Matrix3Xd folded(const Mesh& mesh, double gap_m) {
  Eigen::Matrix3Xd shape = flat_positions(mesh);
  for (Eigen::Index k = 0; k < shape.cols(); ++k) {
    const double beyond_m = shape(0, k) - 0.5 * mesh.width_m;
    if (beyond_m > 1e-9) shape(0, k) = 0.5 * mesh.width_m - beyond_m;
    shape(2, k) = beyond_m > 1e-9 ? gap_m : beyond_m > -1e-9 ? 0.5 * gap_m : 0;
  }
  return shape;
}

/// Returns a crumpled cloth on which the effect can act. For an effect of cloth that touches itself
/// it is folded, and crumpled less so that its layers still meet.
inline Eigen::Matrix3Xd crumpled_for(const std::string& effect, const Mesh& mesh, double share,
                                     Uniform& uniform) {
  if (effect != "self_contact") return crumpled(mesh, share, uniform);
  return folded(mesh, 0.01) + crumpled(mesh, 0.3 * share, uniform) - flat_positions(mesh);
}

}  // namespace clothfit
