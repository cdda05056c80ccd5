#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace clothfit {

/// A rigid transform, named b_from_a: x_b = rotation * x_a + translation_m.
struct Rigid3 {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation_m = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return rotation * point + translation_m;
  }
};

/// Composes c_from_a = c_from_b * b_from_a.
inline Rigid3 operator*(const Rigid3& c_from_b, const Rigid3& b_from_a) {
  return {(c_from_b.rotation * b_from_a.rotation).normalized(),
          c_from_b.rotation * b_from_a.translation_m + c_from_b.translation_m};
}

inline Rigid3 inverse(const Rigid3& b_from_a) {
  const Eigen::Quaterniond back = b_from_a.rotation.conjugate();
  return {back, -(back * b_from_a.translation_m)};
}

/// Returns (exp(w), d), the transform that turns by the rotation vector (rad) and then shifts.
/// Poses are perturbed with it on the left, b_from_a = turn_and_shift(w, d) * estimate, and
/// covariances of poses are those of (w, d).
Rigid3 turn_and_shift(const Eigen::Vector3d& rotation_vector_rad,
                      const Eigen::Vector3d& translation_m);

/// Returns the rotation vector (rad), no longer than pi: the inverse of exp.
Eigen::Vector3d rotation_vector(const Eigen::Quaterniond& rotation);

/// Returns the orthogonal matrix nearest to this one, by the sum of squares; a reflection where
/// that is nearer than any rotation.
Eigen::Matrix3d nearest_orthogonal(const Eigen::Matrix3d& matrix);

/// Returns the rigid transform that takes the columns of `a` closest to those of `b`. Both are
/// 3 x N, N >= 3, not all on a line. Least squares are weighted by `weight` (N; empty: all alike).
/// Umeyama 1991 without scale.
Rigid3 fit_rigid(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b,
                 const Eigen::VectorXd& weight = {});

}  // namespace clothfit
