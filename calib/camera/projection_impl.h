#pragma once

#include <cmath>

// Only calib/camera/projection.h includes this file, behind the declarations.

namespace clothfit {
namespace internal {

/// Applies Brown-Conrady on the plane z = 1, in place; `k` holds 4, 5 or 8 coefficients.
template <class Real>
void distort_brown_conrady(const Real* k, int count, Real& x, Real& y) {
  const Real r2 = x * x + y * y;
  Real radial = Real(1.0) + r2 * (k[0] + r2 * k[1]);
  if (count >= 5) radial = radial + r2 * r2 * r2 * k[4];
  if (count >= 8) radial = radial / (Real(1.0) + r2 * (k[5] + r2 * (k[6] + r2 * k[7])));
  const Real xy = x * y;
  const Real distorted_x = x * radial + Real(2.0) * k[2] * xy + k[3] * (r2 + Real(2.0) * x * x);
  const Real distorted_y = y * radial + k[2] * (r2 + Real(2.0) * y * y) + Real(2.0) * k[3] * xy;
  x = distorted_x;
  y = distorted_y;
}

/// Applies Kannala-Brandt on the plane z = 1, in place; `k` holds 4 coefficients.
template <class Real>
void distort_kannala_brandt(const Real* k, Real& x, Real& y) {
  using std::atan2;
  using std::sqrt;
  const Real r2 = x * x + y * y;
  Real scale = Real(1.0) + r2 * (k[0] - Real(1.0 / 3.0));
  // Near the axis sqrt has no derivative; there the series above is exact to the last bit.
  if (r2 > Real(1e-8)) {
    const Real r = sqrt(r2);
    const Real theta = atan2(r, Real(1.0));
    const Real theta2 = theta * theta;
    const Real polynomial =
        Real(1.0) + theta2 * (k[0] + theta2 * (k[1] + theta2 * (k[2] + theta2 * k[3])));
    scale = theta * polynomial / r;
  }
  x = x * scale;
  y = y * scale;
}

}  // namespace internal

template <class Real>
Eigen::Matrix<Real, 2, 1> project(CameraModel model, const Real* intrinsics, int distortion_count,
                                  const Eigen::Matrix<Real, 3, 1>& point_in_camera) {
  Real x = point_in_camera[0] / point_in_camera[2];
  Real y = point_in_camera[1] / point_in_camera[2];
  const Real* distortion = intrinsics + 4;
  switch (model) {
    case CameraModel::pinhole:
      break;
    case CameraModel::brown_conrady:
      internal::distort_brown_conrady(distortion, distortion_count, x, y);
      break;
    case CameraModel::kannala_brandt:
      internal::distort_kannala_brandt(distortion, x, y);
      break;
  }
  Eigen::Matrix<Real, 2, 1> pixel;
  pixel[0] = intrinsics[0] * x + intrinsics[2];
  pixel[1] = intrinsics[1] * y + intrinsics[3];
  return pixel;
}

}  // namespace clothfit
