#include "tests/model/scalar_reference.h"

#include <cmath>

namespace clothfit {

void add_reference_spring_forces(const SpringNet& net, const SpringParameters& springs,
                                 const Eigen::Matrix3Xd& position_m,
                                 const Eigen::Matrix3Xd& velocity_m_per_s,
                                 Eigen::Matrix3Xd& force_n) {
  for (size_t type = 0; type < kSpringTypes; ++type) {
    for (const auto& [a, b] : net[type]) {
      const double dx = position_m(0, b) - position_m(0, a);
      const double dy = position_m(1, b) - position_m(1, a);
      const double dz = position_m(2, b) - position_m(2, a);
      const double length = std::sqrt(dx * dx + dy * dy + dz * dz);
      if (length == 0) continue;
      const double inverse = 1 / length;
      const double along = dx * (velocity_m_per_s(0, b) - velocity_m_per_s(0, a)) +
                           dy * (velocity_m_per_s(1, b) - velocity_m_per_s(1, a)) +
                           dz * (velocity_m_per_s(2, b) - velocity_m_per_s(2, a));
      const double elastic_n =
          springs.stiffness_n_per_m[type] * (length - springs.natural_length_m[type]);
      const double damping_n = springs.damping_ns_per_m[type] * (along * inverse);
      const double pull = (elastic_n + damping_n) * inverse;
      const double pull_n[3] = {pull * dx, pull * dy, pull * dz};
      for (int axis = 0; axis < 3; ++axis) {
        force_n(axis, a) += pull_n[axis];
        force_n(axis, b) -= pull_n[axis];
      }
    }
  }
}

void reference_euler(const Eigen::VectorXd& mass_kg, double time_step_s,
                     const Eigen::Matrix3Xd& force_n, Eigen::Matrix3Xd& velocity_m_per_s,
                     Eigen::Matrix3Xd& position_m) {
  for (Eigen::Index k = 0; k < mass_kg.size(); ++k) {
    for (int axis = 0; axis < 3; ++axis) {
      velocity_m_per_s(axis, k) += time_step_s / mass_kg[k] * force_n(axis, k);
      position_m(axis, k) += time_step_s * velocity_m_per_s(axis, k);
    }
  }
}

Eigen::Matrix3Xd reference_fall(const Cloth& cloth, const ParameterSet& set, double rate_per_s,
                                double time_step_s, int steps) {
  Eigen::Matrix3Xd p = set.start_position_m;
  Eigen::Matrix3Xd v = Eigen::Matrix3Xd::Zero(3, p.cols());
  for (int n = 0; n < steps; ++n) {
    Eigen::Matrix3Xd f(3, p.cols());
    for (Eigen::Index k = 0; k < p.cols(); ++k) f.col(k) = cloth.mass_kg[k] * set.gravity_m_per_s2;
    add_reference_spring_forces(cloth.springs, set.springs, p, v, f);
    for (Eigen::Index k = 0; k < p.cols(); ++k) {
      const double c = rate_per_s * cloth.mass_kg[k];
      for (int axis = 0; axis < 3; ++axis) f(axis, k) -= c * v(axis, k);
    }
    reference_euler(cloth.mass_kg, time_step_s, f, v, p);
  }
  return p;
}

}  // namespace clothfit
