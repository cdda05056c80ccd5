#include "model/garment/surface_nets.h"

#include <array>
#include <cmath>
#include <utility>
#include <vector>

namespace clothfit {
namespace {

using Field = std::function<double(const Eigen::Vector3d&)>;

/// The field at the corners of a grid.
struct FieldGrid {
  Eigen::Vector3d low_m;
  double cell_m;
  Eigen::Vector3i corners;
  std::vector<double> value;

  FieldGrid(const Field& field, const Eigen::Vector3d& low, const Eigen::Vector3d& high,
            double cell)
      : low_m(low), cell_m(cell), corners(((high - low) / cell).array().ceil().cast<int>() + 1) {
    for (int k = 0; k < corners.z(); ++k)
      for (int j = 0; j < corners.y(); ++j)
        for (int i = 0; i < corners.x(); ++i) value.push_back(field(place_m({i, j, k})));
  }
  size_t index(const Eigen::Vector3i& at) const {
    return static_cast<size_t>((at.z() * corners.y() + at.y()) * corners.x() + at.x());
  }
  double at(const Eigen::Vector3i& corner) const { return value[index(corner)]; }
  Eigen::Vector3d place_m(const Eigen::Vector3i& corner) const {
    return low_m + cell_m * corner.cast<double>();
  }
};

/// Moves a point onto the surface by a few Newton steps along the gradient.
Eigen::Vector3d on_surface(const Field& field, Eigen::Vector3d point_m, double cell_m) {
  const double step_m = 1e-3 * cell_m;
  for (int n = 0; n < 3; ++n) {
    Eigen::Vector3d gradient;
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d aside = step_m * Eigen::Vector3d::Unit(axis);
      gradient[axis] = (field(point_m + aside) - field(point_m - aside)) / (2 * step_m);
    }
    const Eigen::Vector3d step = -field(point_m) / gradient.squaredNorm() * gradient;
    if (!(step.norm() < 0.5 * cell_m)) break;
    point_m += step;
  }
  return point_m;
}

/// Finds the mean of the places where the surface cuts a cell's edges; says whether it cuts any.
bool mean_cut(const FieldGrid& grid, const Eigen::Vector3i& cell, Eigen::Vector3d& mean_m) {
  mean_m.setZero();
  int cuts = 0;
  for (int axis = 0; axis < 3; ++axis)
    for (int other = 0; other < 4; ++other) {
      Eigen::Vector3i from = cell;
      from[(axis + 1) % 3] += other & 1;
      from[(axis + 2) % 3] += other >> 1;
      const double a = grid.at(from), b = grid.at(from + Eigen::Vector3i::Unit(axis));
      if ((a < 0) == (b < 0)) continue;
      mean_m += grid.place_m(from) + a / (a - b) * grid.cell_m * Eigen::Vector3d::Unit(axis);
      ++cuts;
    }
  if (cuts > 0) mean_m /= cuts;
  return cuts > 0;
}

/// The vertices of cut cells and the triangles between them.
class Net {
 public:
  Net(const Field& field, const FieldGrid& grid) : grid_(grid), of_cell_(grid.value.size(), -1) {
    for_each_cell(0, [&](const Eigen::Vector3i& cell) {
      Eigen::Vector3d mean_m;
      if (!mean_cut(grid, cell, mean_m)) return;
      of_cell_[grid.index(cell)] = static_cast<int>(vertices_.size());
      // Vertices that leave their cells fold the surface.
      const Eigen::Vector3d low_m = grid.place_m(cell),
                            high_m = grid.place_m(cell + Eigen::Vector3i::Ones());
      vertices_.push_back(on_surface(field, mean_m, grid.cell_m).cwiseMax(low_m).cwiseMin(high_m));
    });
    for_each_cell(1, [&](const Eigen::Vector3i& corner) {
      for (int axis = 0; axis < 3; ++axis) add_between(corner, axis);
    });
  }

  TriangleMesh mesh() const {
    TriangleMesh mesh;
    mesh.vertex_m.resize(3, static_cast<Eigen::Index>(vertices_.size()));
    mesh.triangle.resize(3, static_cast<Eigen::Index>(triangles_.size()));
    for (size_t v = 0; v < vertices_.size(); ++v)
      mesh.vertex_m.col(static_cast<Eigen::Index>(v)) = vertices_[v];
    for (size_t t = 0; t < triangles_.size(); ++t)
      mesh.triangle.col(static_cast<Eigen::Index>(t)) = triangles_[t];
    return mesh;
  }

 private:
  template <class Body>
  void for_each_cell(int first, const Body& body) const {
    for (int k = first; k + 1 < grid_.corners.z(); ++k)
      for (int j = first; j + 1 < grid_.corners.y(); ++j)
        for (int i = first; i + 1 < grid_.corners.x(); ++i) body(Eigen::Vector3i{i, j, k});
  }

  /// Joins the vertices of the four cells around an edge that the surface cuts.
  void add_between(const Eigen::Vector3i& from, int axis) {
    const bool inside = grid_.at(from) < 0;
    if (inside == (grid_.at(from + Eigen::Vector3i::Unit(axis)) < 0)) return;
    const Eigen::Vector3i u = Eigen::Vector3i::Unit((axis + 1) % 3),
                          v = Eigen::Vector3i::Unit((axis + 2) % 3);
    std::array corner{of_cell_[grid_.index(from - u - v)], of_cell_[grid_.index(from - v)],
                      of_cell_[grid_.index(from)], of_cell_[grid_.index(from - u)]};
    if (!inside) std::swap(corner[1], corner[3]);
    const auto diagonal_m = [&](size_t a, size_t b) {
      return (vertices_[static_cast<size_t>(corner[a])] - vertices_[static_cast<size_t>(corner[b])])
          .norm();
    };
    const size_t k = diagonal_m(0, 2) <= diagonal_m(1, 3) ? 0 : 1;  // the shorter one cuts it
    triangles_.emplace_back(corner[k], corner[k + 1], corner[k + 2]);
    triangles_.emplace_back(corner[k], corner[k + 2], corner[(k + 3) % 4]);
  }

  const FieldGrid& grid_;
  std::vector<int> of_cell_;  ///< vertex of the cell above each corner; -1: none
  std::vector<Eigen::Vector3d> vertices_;
  std::vector<Eigen::Vector3i> triangles_;
};

}  // namespace

TriangleMesh zero_surface(const Field& field, const Eigen::Vector3d& low_m,
                          const Eigen::Vector3d& high_m, double cell_m) {
  const FieldGrid grid(field, low_m, high_m, cell_m);
  return Net(field, grid).mesh();
}

}  // namespace clothfit
