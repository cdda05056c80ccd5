#pragma once

// Private to calib/: poses as parameter blocks of Ceres.

#include <ceres/autodiff_manifold.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "calib/camera/rigid3.h"

namespace clothfit {

/// A pose b_from_a as Ceres sees it: quaternion x y z w, then translation.
using PoseBlock = std::array<double, 7>;

inline PoseBlock to_block(const Rigid3& pose) {
  const auto& q = pose.rotation.coeffs();
  const auto& t = pose.translation_m;
  return {q[0], q[1], q[2], q[3], t[0], t[1], t[2]};
}

inline Rigid3 from_block(const PoseBlock& block) {
  return {Eigen::Quaterniond(Eigen::Map<const Eigen::Vector4d>(block.data())).normalized(),
          Eigen::Map<const Eigen::Vector3d>(block.data() + 4)};
}

/// Returns the point `point_in_a` in frame b.
template <class Real>
Eigen::Matrix<Real, 3, 1> transform(const Real* b_from_a,
                                    const Eigen::Matrix<Real, 3, 1>& point_in_a) {
  const Eigen::Map<const Eigen::Quaternion<Real>> rotation(b_from_a);
  const Eigen::Map<const Eigen::Matrix<Real, 3, 1>> translation(b_from_a + 4);
  return rotation * point_in_a + translation;
}

/// Perturbs a pose on the left, x <- (exp(w), d) x with tangent (w, d), the same as
/// turn_and_shift(w, d). Covariances in the tangent space are then those that
/// CameraPose::covariance wants.
struct PoseManifoldFunctor {
  template <class Real>
  bool Plus(const Real* x, const Real* tangent, Real* x_plus) const {
    using std::cos;
    using std::sin;
    using std::sqrt;
    const Eigen::Map<const Eigen::Matrix<Real, 3, 1>> w(tangent);
    const Eigen::Map<const Eigen::Matrix<Real, 3, 1>> shift(tangent + 3);
    const Real half2 = Real(0.25) * w.squaredNorm();
    // The root has no derivative at 0; the series has one and is exact to the last bit below 1e-8.
    Real cosine = Real(1.0) - Real(0.5) * half2;
    Real sinc = Real(1.0) - half2 / Real(6.0);
    if (half2 > Real(1e-8)) {
      const Real half = sqrt(half2);
      cosine = cos(half);
      sinc = sin(half) / half;
    }
    Eigen::Quaternion<Real> turn;
    turn.w() = cosine;
    turn.vec() = Real(0.5) * sinc * w;
    const Eigen::Map<const Eigen::Quaternion<Real>> rotation(x);
    const Eigen::Map<const Eigen::Matrix<Real, 3, 1>> translation(x + 4);
    Eigen::Map<Eigen::Quaternion<Real>> new_rotation(x_plus);
    Eigen::Map<Eigen::Matrix<Real, 3, 1>> new_translation(x_plus + 4);
    new_translation = turn * translation + shift;
    new_rotation = (turn * rotation).normalized();
    return true;
  }

  template <class Real>
  bool Minus(const Real* y, const Real* x, Real* tangent) const {
    using std::atan2;
    using std::sqrt;
    const Eigen::Map<const Eigen::Quaternion<Real>> y_rotation(y);
    const Eigen::Map<const Eigen::Quaternion<Real>> x_rotation(x);
    const Eigen::Map<const Eigen::Matrix<Real, 3, 1>> y_translation(y + 4);
    const Eigen::Map<const Eigen::Matrix<Real, 3, 1>> x_translation(x + 4);
    Eigen::Quaternion<Real> turn = y_rotation * x_rotation.conjugate();
    if (turn.w() < Real(0.0)) turn.coeffs() = -turn.coeffs();
    const Real sine2 = turn.vec().squaredNorm();
    Real factor = Real(2.0) / turn.w();
    if (sine2 > Real(1e-16)) {
      const Real sine = sqrt(sine2);
      factor = Real(2.0) * atan2(sine, turn.w()) / sine;
    }
    Eigen::Map<Eigen::Matrix<Real, 3, 1>> w(tangent);
    Eigen::Map<Eigen::Matrix<Real, 3, 1>> shift(tangent + 3);
    w = factor * turn.vec();
    shift = y_translation - turn * x_translation;
    return true;
  }
};
using PoseManifold = ceres::AutoDiffManifold<PoseManifoldFunctor, 7, 6>;

}  // namespace clothfit
