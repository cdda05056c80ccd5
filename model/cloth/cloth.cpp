#include "model/cloth/cloth.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "data/input_error.h"

namespace clothfit {

HeldVertexWeights held_at(const Mesh& mesh, double s_m, double t_m) {
  // Readers allow a micrometre outside for rounding.
  assert(s_m > -2e-6 && s_m < mesh.width_m + 2e-6 && t_m > -2e-6 && t_m < mesh.height_m + 2e-6);
  // A point within a millionth of a cell of a vertex is that vertex: markers are written in
  // decimals.
  const auto locate = [](double place, int count, int& cell, double& fraction) {
    const double rounded = std::round(place);
    if (std::abs(place - rounded) < 1e-6) place = rounded;
    cell = std::clamp(static_cast<int>(std::floor(place)), 0, count - 2);
    fraction = std::clamp(place - cell, 0.0, 1.0);
  };
  int i = 0, j = 0;
  double down = 0, right = 0;
  locate(t_m / mesh.spacing_t_m(), mesh.rows, i, down);
  locate(s_m / mesh.spacing_s_m(), mesh.columns, j, right);
  HeldVertexWeights held;
  const auto add = [&](int vertex, double weight) {
    if (weight > 0) held.weights.push_back({vertex, weight});
  };
  add(mesh.vertex(i, j), (1 - down) * (1 - right));
  add(mesh.vertex(i, j + 1), (1 - down) * right);
  add(mesh.vertex(i + 1, j), down * (1 - right));
  add(mesh.vertex(i + 1, j + 1), down * right);
  return held;
}

Cloth Cloth::of(const Mesh& mesh, Eigen::VectorXd mass_kg) {
  assert(mass_kg.size() == mesh.vertex_count() && mass_kg.minCoeff() > 0);
  Cloth cloth;
  cloth.mesh = mesh;
  cloth.springs = make_springs(mesh);
  cloth.mass_kg = std::move(mass_kg);
  return cloth;
}

Eigen::Vector3d shifted(const Eigen::Vector3d& motion_m, const ParameterSet& set, size_t held,
                        double time_s) {
  assert(set.held_shift.empty() || held < set.held_shift.size());
  if (set.held_shift.empty() || !set.held_shift[held]) return motion_m;
  return motion_m + set.held_shift[held](time_s);
}

size_t Cloth::spring_count() const {
  size_t count = 0;
  for (const std::vector<Spring>& type : springs) count += type.size();
  return count;
}

}  // namespace clothfit
