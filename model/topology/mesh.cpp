#include "model/topology/mesh.h"

#include <cmath>

namespace clothfit {

SpringNet make_springs(const Mesh& mesh) {
  SpringNet net;
  // A spring of each type leads from [i + from_i, j] to [i + to_i, j + to_j].
  struct Link {
    int from_i, to_i, to_j;
  };
  constexpr std::array<Link, kSpringTypes> links = {
      {{0, 1, 0}, {0, 0, 1}, {0, 1, 1}, {1, 0, 1}, {0, 2, 0}, {0, 0, 2}}};
  for (int type = 0; type < kSpringTypes; ++type) {
    const Link link = links[static_cast<size_t>(type)];
    const int last_i = mesh.rows - std::max(link.from_i, link.to_i);
    const int last_j = mesh.columns - link.to_j;
    for (int i = 0; i < last_i; ++i)
      for (int j = 0; j < last_j; ++j)
        net[static_cast<size_t>(type)].push_back(
            {mesh.vertex(i + link.from_i, j), mesh.vertex(i + link.to_i, j + link.to_j)});
  }
  return net;
}

std::array<double, kSpringTypes> flat_lengths(const Mesh& mesh) {
  const double s = mesh.spacing_s_m();
  const double t = mesh.spacing_t_m();
  const double diagonal = std::hypot(s, t);
  return {t, s, diagonal, diagonal, 2 * t, 2 * s};
}

Eigen::Matrix3Xd flat_positions(const Mesh& mesh) {
  Eigen::Matrix3Xd flat(3, mesh.vertex_count());
  for (int i = 0; i < mesh.rows; ++i)
    for (int j = 0; j < mesh.columns; ++j)
      flat.col(mesh.vertex(i, j)) << j * mesh.spacing_s_m(), i * mesh.spacing_t_m(), 0.0;
  return flat;
}

namespace {

bool on_border(int index, int count) {
  return index == 0 || index == count - 1;
}

}  // namespace

Eigen::VectorXd masses_by_area(const Mesh& mesh, double mass_kg) {
  const double cell = mass_kg / ((mesh.columns - 1) * (mesh.rows - 1));
  Eigen::VectorXd masses(mesh.vertex_count());
  for (int i = 0; i < mesh.rows; ++i)
    for (int j = 0; j < mesh.columns; ++j)
      masses[mesh.vertex(i, j)] =
          cell * (on_border(i, mesh.rows) ? 0.5 : 1.0) * (on_border(j, mesh.columns) ? 0.5 : 1.0);
  return masses;
}

Eigen::VectorXd masses_equal(const Mesh& mesh, const Mesh& reference, double mass_kg) {
  const double m0 = mass_kg / reference.vertex_count();
  const int cells_s = reference.columns - 1;
  const int cells_t = reference.rows - 1;
  Eigen::VectorXd masses = masses_by_area(mesh, m0 * cells_s * cells_t);
  // The surplus of an edge is a line of m0 / 2 per spacing of the reference; a line's end vertices
  // carry half a spacing each.
  const double edge_s = 0.5 * m0 * cells_s / (mesh.columns - 1);
  const double edge_t = 0.5 * m0 * cells_t / (mesh.rows - 1);
  for (int i = 0; i < mesh.rows; ++i) {
    for (int j = 0; j < mesh.columns; ++j) {
      const bool border_i = on_border(i, mesh.rows);
      const bool border_j = on_border(j, mesh.columns);
      double& mass = masses[mesh.vertex(i, j)];
      if (border_i) mass += edge_s * (border_j ? 0.5 : 1.0);
      if (border_j) mass += edge_t * (border_i ? 0.5 : 1.0);
      if (border_i && border_j) mass += 0.25 * m0;
    }
  }
  return masses;
}

}  // namespace clothfit
