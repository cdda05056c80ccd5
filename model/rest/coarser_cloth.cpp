#include "model/rest/coarser_cloth.h"

#include <algorithm>
#include <cmath>

namespace clothfit {

Mesh coarser_mesh(const Mesh& mesh, int least) {
  const auto halve = [least](int count) { return count < least ? count : count / 2 + 1; };
  return {.columns = halve(mesh.columns),
          .rows = halve(mesh.rows),
          .width_m = mesh.width_m,
          .height_m = mesh.height_m};
}

namespace {

/// The cell of `mesh` in which the vertex [i, j] of `other` lies, and its place there.
struct CellPlace {
  int i, j;
  double down, right;  ///< from 0 to 1
};

CellPlace find_cell(const Mesh& mesh, const Mesh& other, int i, int j) {
  // Whole numbers decide, so that vertices of both meshes are found to be in the same place.
  const auto find = [](int index, int from_cells, int cells, int& cell) {
    const long scaled = static_cast<long>(index) * cells;
    cell = std::min(static_cast<int>(scaled / from_cells), cells - 1);
    return static_cast<double>(scaled - static_cast<long>(cell) * from_cells) / from_cells;
  };
  CellPlace place{};
  place.down = find(i, other.rows - 1, mesh.rows - 1, place.i);
  place.right = find(j, other.columns - 1, mesh.columns - 1, place.j);
  return place;
}

}  // namespace

HangingCloth on_mesh(const HangingCloth& cloth, const Mesh& mesh) {
  HangingCloth result = cloth;
  result.mesh = mesh;
  const std::array<double, kSpringTypes> from = flat_lengths(cloth.mesh), to = flat_lengths(mesh);
  // A longer spring stands for so much more of the sheet that k l^2 / area stays.
  const double fewer = cloth.mesh.spacing_s_m() * cloth.mesh.spacing_t_m() /
                       (mesh.spacing_s_m() * mesh.spacing_t_m());
  for (size_t t = 0; t < kSpringTypes; ++t) {
    const double longer = to[t] / from[t];
    result.natural_length_m[t] *= longer;
    result.stiffness_n_per_m[t] /= longer * longer * fewer;
  }
  result.mass_kg = Eigen::VectorXd::Zero(mesh.vertex_count());
  for (int i = 0; i < cloth.mesh.rows; ++i) {
    for (int j = 0; j < cloth.mesh.columns; ++j) {
      const CellPlace at = find_cell(mesh, cloth.mesh, i, j);
      const double mass = cloth.mass_kg[cloth.mesh.vertex(i, j)];
      result.mass_kg[mesh.vertex(at.i, at.j)] += mass * (1 - at.down) * (1 - at.right);
      result.mass_kg[mesh.vertex(at.i, at.j + 1)] += mass * (1 - at.down) * at.right;
      result.mass_kg[mesh.vertex(at.i + 1, at.j)] += mass * at.down * (1 - at.right);
      result.mass_kg[mesh.vertex(at.i + 1, at.j + 1)] += mass * at.down * at.right;
    }
  }
  return result;
}

std::vector<HeldVertexWeights> on_mesh(const std::vector<HeldVertexWeights>& held, const Mesh& from,
                                       const Mesh& to) {
  std::vector<HeldVertexWeights> result;
  for (const HeldVertexWeights& point : held) {
    double s = 0, t = 0;
    for (const auto& [vertex, weight] : point.weights) {
      s += weight * (vertex % from.columns) * from.spacing_s_m();
      t += weight * (vertex / from.columns) * from.spacing_t_m();
    }
    result.push_back(held_at(to, std::clamp(s, 0.0, to.width_m), std::clamp(t, 0.0, to.height_m)));
    result.back().motion = point.motion;
  }
  return result;
}

Eigen::Matrix3Xd transfer_shape(const Mesh& from, const Eigen::Matrix3Xd& position_m,
                                const Mesh& to) {
  Eigen::Matrix3Xd result(3, to.vertex_count());
  for (int i = 0; i < to.rows; ++i) {
    for (int j = 0; j < to.columns; ++j) {
      const CellPlace at = find_cell(from, to, i, j);
      const auto corner = [&](int down, int right) {
        return position_m.col(from.vertex(at.i + down, at.j + right));
      };
      // The triangle's third corner lies on the side of the diagonal where the vertex is.
      const double far = std::min(at.down, at.right), near = 1 - std::max(at.down, at.right);
      const bool above = at.right >= at.down;
      result.col(to.vertex(i, j)) =
          near * corner(0, 0) + far * corner(1, 1) +
          std::abs(at.right - at.down) * corner(above ? 0 : 1, above ? 1 : 0);
    }
  }
  return result;
}

}  // namespace clothfit
