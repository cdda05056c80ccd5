#include "model/rest/equilibrium_derivatives.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cassert>

#include "model/rest/held_projection.h"

namespace clothfit {
namespace {

using Sparse = Eigen::SparseMatrix<double>;
using Triplets = std::vector<Eigen::Triplet<double>>;

/// Coordinate c of vertex v is unknown 3 v + c.
Eigen::Map<const Eigen::VectorXd> flat(const Eigen::Matrix3Xd& vectors) {
  return {vectors.data(), vectors.size()};
}

Sparse second_derivative(const HangingCloth& cloth, const SpringNet& net,
                         const Eigen::Matrix3Xd& position_m) {
  Triplets entries;
  for (size_t t = 0; t < kSpringTypes; ++t) {
    const double k = cloth.stiffness_n_per_m[t], l0 = cloth.natural_length_m[t];
    if (k == 0) continue;
    for (const Spring& spring : net[t]) {
      const Eigen::Vector3d along = position_m.col(spring.b) - position_m.col(spring.a);
      const double length = std::max(along.norm(), 1e-100);
      const Eigen::Vector3d u = along / length;
      const Eigen::Matrix3d block =
          k * (1 - l0 / length) * Eigen::Matrix3d::Identity() + k * l0 / length * u * u.transpose();
      for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column)
          for (const auto& [at, to, sign] : {std::tuple{spring.a, spring.a, 1},
                                             {spring.b, spring.b, 1},
                                             {spring.a, spring.b, -1},
                                             {spring.b, spring.a, -1}})
            entries.emplace_back(3 * at + row, 3 * to + column, sign * block(row, column));
    }
  }
  const Eigen::Index size = position_m.size();
  Sparse matrix(size, size);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

/// Returns how the gradient changes along `direction` while the shape stays.
Eigen::Matrix3Xd gradient_change(const HangingCloth& cloth, const SpringNet& net,
                                 const Eigen::Matrix3Xd& position_m,
                                 const EquilibriumDirection& direction) {
  Eigen::Matrix3Xd change = -direction.gravity_m_per_s2 * cloth.mass_kg.transpose();
  if (direction.mass_kg.size() > 0)
    change -= cloth.gravity_m_per_s2 * direction.mass_kg.transpose();
  for (size_t t = 0; t < kSpringTypes; ++t) {
    const double dk = direction.stiffness_n_per_m[t], dl0 = direction.natural_length_m[t];
    if (dk == 0 && dl0 == 0) continue;
    for (const Spring& spring : net[t]) {
      const Eigen::Vector3d along = position_m.col(spring.b) - position_m.col(spring.a);
      const double length = std::max(along.norm(), 1e-100);
      const double tension =
          dk * (length - cloth.natural_length_m[t]) - cloth.stiffness_n_per_m[t] * dl0;
      change.col(spring.a) -= tension / length * along;
      change.col(spring.b) += tension / length * along;
    }
  }
  return change;
}

}  // namespace

EquilibriumDerivatives equilibrium_derivatives(const HangingCloth& cloth,
                                               const std::vector<HeldVertexWeights>& held,
                                               const Eigen::Matrix3Xd& position_m,
                                               std::span<const EquilibriumDirection> directions) {
  assert(position_m.cols() == cloth.mesh.vertex_count());
  const SpringNet net = make_springs(cloth.mesh);
  const HeldProjection projection(cloth.mesh, held);
  const Sparse second = second_derivative(cloth, net, position_m);
  const Sparse motions = allowed_motions(projection, cloth.mesh.vertex_count());
  const Sparse reduced = motions.transpose() * second * motions;

  EquilibriumDerivatives result;
  const Eigen::SimplicialLDLT<Sparse> factors(reduced);
  // A pivot is the stiffness of an unknown once all before it may give way. If a motion costs
  // nothing, rounding leaves this share of the stiffest pivots.
  constexpr double kNothing = 1e-11;
  if (factors.info() != Eigen::Success) return result;
  const Eigen::VectorXd pivots = factors.vectorD();
  const double softest = pivots.minCoeff(), stiffest = pivots.cwiseAbs().maxCoeff();
  if (softest < -kNothing * stiffest) {
    result.reason = DerivativeReason::unstable;
    return result;
  }
  if (!(softest > kNothing * stiffest)) return result;

  result.reason = DerivativeReason::found;
  for (const EquilibriumDirection& direction : directions) {
    const FieldLayout layout = FieldLayout::of(cloth.mesh);
    MeshField placed(layout);
    if (direction.held_target_m.size() > 0) projection.place(direction.held_target_m, placed);
    const Eigen::Matrix3Xd prescribed = placed.vectors();
    const Eigen::Matrix3Xd change = gradient_change(cloth, net, position_m, direction);
    const Eigen::VectorXd load = flat(change) + second * flat(prescribed);
    const Eigen::VectorXd free = factors.solve(-(motions.transpose() * load));
    const Eigen::VectorXd moved = flat(prescribed) + motions * free;
    result.position_m.emplace_back(
        Eigen::Map<const Eigen::Matrix3Xd>(moved.data(), 3, position_m.cols()));
  }
  return result;
}

}  // namespace clothfit
