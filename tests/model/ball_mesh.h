#pragma once

#include <Eigen/Geometry>
#include <map>
#include <vector>

#include "model/topology/obstacle.h"

namespace clothfit {

/// Makes the unit ball of an octahedron whose faces are cut in four `times` times, corners on the
/// sphere.
inline TriangleMesh ball_mesh(int times) {
  std::vector<Eigen::Vector3d> vertices;
  for (int axis = 0; axis < 3; ++axis)
    for (const int sign : {1, -1}) vertices.push_back(sign * Eigen::Vector3d::Unit(axis));
  std::vector<Eigen::Vector3i> triangles;
  for (const int x : {0, 1})
    for (const int y : {2, 3})
      for (const int z : {4, 5})
        triangles.push_back((x + y + z) % 2 == 0 ? Eigen::Vector3i(x, y, z)
                                                 : Eigen::Vector3i(x, z, y));
  for (int n = 0; n < times; ++n) {
    std::map<std::pair<int, int>, int> middles;
    const auto middle = [&](int a, int b) {
      const auto [found, is_new] =
          middles.emplace(std::minmax({a, b}), static_cast<int>(vertices.size()));
      if (is_new)
        vertices.push_back(
            (vertices[static_cast<size_t>(a)] + vertices[static_cast<size_t>(b)]).normalized());
      return found->second;
    };
    std::vector<Eigen::Vector3i> finer;
    for (const Eigen::Vector3i& t : triangles) {
      const int ab = middle(t[0], t[1]), bc = middle(t[1], t[2]), ca = middle(t[2], t[0]);
      for (const auto& small : {Eigen::Vector3i(t[0], ab, ca), Eigen::Vector3i(t[1], bc, ab),
                                Eigen::Vector3i(t[2], ca, bc), Eigen::Vector3i(ab, bc, ca)})
        finer.push_back(small);
    }
    triangles = finer;
  }
  TriangleMesh mesh{Eigen::Matrix3Xd(3, static_cast<Eigen::Index>(vertices.size())),
                    Eigen::Matrix3Xi(3, static_cast<Eigen::Index>(triangles.size()))};
  for (size_t v = 0; v < vertices.size(); ++v)
    mesh.vertex_m.col(static_cast<Eigen::Index>(v)) = vertices[v];
  for (size_t t = 0; t < triangles.size(); ++t)
    mesh.triangle.col(static_cast<Eigen::Index>(t)) = triangles[t];
  return mesh;
}

}  // namespace clothfit
