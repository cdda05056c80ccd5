#include "tests/model/scalar_reference.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>

namespace clothfit {

namespace {

/// Computes 1 / sqrt(x) as the model defines it: a guess from the exponent's bits and four Newton
/// steps.
double inverse_square_root(double x) {
  x = std::max(x, 1e-290);
  double y = std::bit_cast<double>(0x5fe6eb50c7b537a9 - (std::bit_cast<std::int64_t>(x) >> 1));
  for (int n = 0; n < 4; ++n) y = y * (1.5 - (0.5 * x) * (y * y));
  return y;
}

}  // namespace

Eigen::Matrix3Xd reference_spring_forces(const Mesh& mesh, const SpringParameters& springs,
                                         const Eigen::Matrix3Xd& position_m,
                                         const Eigen::Matrix3Xd& velocity_m_per_s) {
  // Forces of the spring of each type on the vertex that it leaves to the right or down.
  std::array<Eigen::Matrix3Xd, kSpringTypes> leaving;
  const SpringNet net = make_springs(mesh);
  for (size_t type = 0; type < kSpringTypes; ++type) {
    leaving[type] = Eigen::Matrix3Xd::Zero(3, position_m.cols());
    for (const Spring& spring : net[type]) {
      const int self = type == shear_up ? spring.b : spring.a;
      const int other = type == shear_up ? spring.a : spring.b;
      const double dx = position_m(0, other) - position_m(0, self);
      const double dy = position_m(1, other) - position_m(1, self);
      const double dz = position_m(2, other) - position_m(2, self);
      const double length2 = dx * dx + dy * dy + dz * dz;
      const double inverse = inverse_square_root(length2);
      const double along = dx * (velocity_m_per_s(0, other) - velocity_m_per_s(0, self)) +
                           dy * (velocity_m_per_s(1, other) - velocity_m_per_s(1, self)) +
                           dz * (velocity_m_per_s(2, other) - velocity_m_per_s(2, self));
      const double elastic_n =
          springs.stiffness_n_per_m[type] * (length2 * inverse - springs.natural_length_m[type]);
      const double damping_n = springs.damping_ns_per_m[type] * (along * inverse);
      const double pull = (elastic_n + damping_n) * inverse;
      leaving[type].col(self) << pull * dx, pull * dy, pull * dz;
    }
  }
  const auto from = [&](SpringType type, int i, int j) -> Eigen::Vector3d {
    const bool inside = i >= 0 && j >= 0 && j < mesh.columns;
    if (!inside) return Eigen::Vector3d::Zero();
    return leaving[type].col(mesh.vertex(i, j));
  };
  Eigen::Matrix3Xd force_n(3, position_m.cols());
  for (int i = 0; i < mesh.rows; ++i) {
    for (int j = 0; j < mesh.columns; ++j) {
      const Eigen::Vector3d above =
          (from(structural_t, i - 1, j) + from(shear_down, i - 1, j - 1)) +
          from(shear_up, i - 1, j + 1);
      Eigen::Vector3d sum = -(above + from(flexion_t, i - 2, j));
      sum -= from(structural_s, i, j - 1);
      sum -= from(flexion_s, i, j - 2);
      for (const SpringType type :
           {structural_s, flexion_s, flexion_t, shear_up, structural_t, shear_down})
        sum += from(type, i, j);
      force_n.col(mesh.vertex(i, j)) = sum;
    }
  }
  return force_n;
}

void reference_euler(const Eigen::VectorXd& mass_kg, const Eigen::Vector3d& gravity_m_per_s2,
                     double time_step_s, const Eigen::Matrix3Xd& force_n,
                     Eigen::Matrix3Xd& velocity_m_per_s, Eigen::Matrix3Xd& position_m) {
  for (Eigen::Index k = 0; k < mass_kg.size(); ++k) {
    const double inverse_mass = 1 / mass_kg[k];
    for (int axis = 0; axis < 3; ++axis) {
      const double acceleration = gravity_m_per_s2[axis] + force_n(axis, k) * inverse_mass;
      velocity_m_per_s(axis, k) += time_step_s * acceleration;
      position_m(axis, k) += time_step_s * velocity_m_per_s(axis, k);
    }
  }
}

Eigen::Matrix3Xd reference_fall(const Cloth& cloth, const ParameterSet& set, double rate_per_s,
                                double time_step_s, int steps) {
  Eigen::Matrix3Xd p = set.start_position_m;
  Eigen::Matrix3Xd v = Eigen::Matrix3Xd::Zero(3, p.cols());
  for (int n = 0; n < steps; ++n) {
    Eigen::Matrix3Xd f = reference_spring_forces(cloth.mesh, set.springs, p, v);
    for (Eigen::Index k = 0; k < p.cols(); ++k) {
      const double c = rate_per_s * cloth.mass_kg[k];
      for (int axis = 0; axis < 3; ++axis) f(axis, k) -= c * v(axis, k);
    }
    reference_euler(cloth.mass_kg, set.gravity_m_per_s2, time_step_s, f, v, p);
  }
  return p;
}

}  // namespace clothfit
