#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>

#include "model/kernels/lanes.h"
#include "model/topology/mesh.h"

namespace clothfit {

/// The places of a mesh's vertices in memory: row by row. Each row is padded with zeros to whole
/// vectors, so that a spring's far end two columns on may be read past the last vertex.
struct FieldLayout {
  int columns = 0;
  int rows = 0;
  std::ptrdiff_t stride = 0;  ///< doubles from a row to the next; a multiple of kLanes

  static FieldLayout of(int columns, int rows) {
    return {columns, rows, (columns + 2 + kLanes - 1) / kLanes * kLanes};
  }
  static FieldLayout of(const Mesh& mesh) { return of(mesh.columns, mesh.rows); }
  std::ptrdiff_t plane() const { return stride * rows; }
  std::ptrdiff_t at(int i, int j) const { return i * stride + j; }
  std::ptrdiff_t at(int vertex) const { return at(vertex / columns, vertex % columns); }
};

/// A vector at every vertex of a mesh: three planes x, y, z behind one another. Padding is always
/// zero, so that whole planes may be added and multiplied.
struct MeshField {
  FieldLayout layout;
  Eigen::ArrayXd values;  ///< 3 planes, and a few zeros to be read past the end

  MeshField() = default;
  explicit MeshField(const FieldLayout& where)
      : layout(where), values(Eigen::ArrayXd::Zero(3 * where.plane() + 2 * kLanes)) {}
  static MeshField of(const FieldLayout& layout, const Eigen::Matrix3Xd& vectors);

  double* plane(int axis) { return values.data() + axis * layout.plane(); }
  const double* plane(int axis) const { return values.data() + axis * layout.plane(); }
  std::array<double*, 3> planes() { return {plane(0), plane(1), plane(2)}; }
  std::array<const double*, 3> planes() const { return {plane(0), plane(1), plane(2)}; }
  Eigen::Vector3d at(int vertex) const {
    const std::ptrdiff_t k = layout.at(vertex);
    return {plane(0)[k], plane(1)[k], plane(2)[k]};
  }
  void set(int vertex, const Eigen::Vector3d& value) {
    const std::ptrdiff_t k = layout.at(vertex);
    for (int axis = 0; axis < 3; ++axis) plane(axis)[k] = value[axis];
  }
  Eigen::Matrix3Xd vectors() const;  ///< 3 x vertices
};

/// Returns the sum of a_k b_k in an order that depends on the size alone. The bits are the same for
/// any number of threads and on every processor.
double dot(const MeshField& a, const MeshField& b);
double norm(const MeshField& a);

/// Computes y += factor * x.
void add_scaled(double factor, const MeshField& x, MeshField& y);

/// Computes y = x + factor * y.
void scale_and_add(const MeshField& x, double factor, MeshField& y);

}  // namespace clothfit
