#include "calib/camera/rigid3.h"

#include <Eigen/SVD>
#include <cassert>
#include <cmath>

namespace clothfit {

Rigid3 turn_and_shift(const Eigen::Vector3d& rotation_vector_rad,
                      const Eigen::Vector3d& translation_m) {
  const double half_angle = 0.5 * rotation_vector_rad.norm();
  // Near 0 the quotient sin(h) / h is undefined and its series serves.
  const double sinc =
      half_angle > 1e-4 ? std::sin(half_angle) / half_angle : 1 - half_angle * half_angle / 6;
  Eigen::Quaterniond rotation;
  rotation.w() = std::cos(half_angle);
  rotation.vec() = 0.5 * sinc * rotation_vector_rad;
  return {rotation, translation_m};
}

Eigen::Vector3d rotation_vector(const Eigen::Quaterniond& rotation) {
  // q and -q are one rotation; the half angle of the nearer one is at most pi / 2.
  const Eigen::Vector3d axis = std::copysign(1.0, rotation.w()) * rotation.vec();
  const double sine = axis.norm();
  const double cosine = std::abs(rotation.w());
  const double factor = sine > 1e-8 ? 2 * std::atan2(sine, cosine) / sine : 2 / cosine;
  return factor * axis;
}

Eigen::Matrix3d nearest_orthogonal(const Eigen::Matrix3d& matrix) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return svd.matrixU() * svd.matrixV().transpose();
}

Rigid3 fit_rigid(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b,
                 const Eigen::VectorXd& weight) {
  assert(a.cols() == b.cols() && a.cols() >= 3);
  assert(weight.size() == 0 || weight.size() == a.cols());
  const Eigen::VectorXd share =
      weight.size() == 0 ? Eigen::VectorXd::Constant(a.cols(), 1.0 / static_cast<double>(a.cols()))
                         : Eigen::VectorXd(weight / weight.sum());

  const Eigen::Vector3d a_mean = a * share;
  const Eigen::Vector3d b_mean = b * share;
  const Eigen::Matrix3d cross =
      (b.colwise() - b_mean) * share.asDiagonal() * (a.colwise() - a_mean).transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(cross, Eigen::ComputeFullU | Eigen::ComputeFullV);
  // The best orthogonal matrix may be a reflection (points in a plane, or much noise). Turning the
  // weakest direction round makes it the best rotation.
  Eigen::Vector3d sign(1, 1, 1);
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0) sign.z() = -1;
  const Eigen::Matrix3d rotation = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
  return {Eigen::Quaterniond(rotation).normalized(), b_mean - rotation * a_mean};
}

}  // namespace clothfit
