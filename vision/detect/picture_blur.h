#pragma once

#include <Eigen/Core>
#include <array>

namespace clothfit {

/// The blur of a picture around a tag: a lens, round in the picture, and motion along a line. Its
/// three unknowns are the logarithm of its covariance C (px^2),
///
///   C = exp(s0) (cosh r I + sinh r / r [s1 s2; s2 -s1]),  r = hypot(s1, s2),
///
/// so that every value is a blur, none has a direction that matters at r = 0, and the direction
/// needs no start of its own.
class PictureBlur {
 public:
  using Unknowns = Eigen::Vector3d;

  /// Returns the unknowns of a lens of that standard deviation (> 0) with motion on top.
  static Unknowns unknowns(double lens_px, const Eigen::Vector2d& motion_px);

  /// Returns the unknowns of a blur of that covariance, which is positive definite.
  static Unknowns unknowns(const Eigen::Matrix2d& covariance_px2);

  explicit PictureBlur(const Unknowns& unknowns);

  const Eigen::Matrix2d& covariance_px2() const { return covariance_px2_; }
  /// Returns the derivative of the covariance by each unknown.
  std::array<Eigen::Matrix2d, 3> covariance_slopes() const;
  /// Returns the variance of the lens: the smaller of the two principal ones.
  double lens_variance_px2() const { return lens_variance_px2_; }
  /// Returns the motion while the shutter is open, px; its sign means nothing. A point that moves
  /// evenly along L has the variance L^2 / 12.
  const Eigen::Vector2d& motion_px() const { return motion_px_; }

 private:
  Unknowns unknowns_;
  Eigen::Matrix2d covariance_px2_;
  double lens_variance_px2_;
  Eigen::Vector2d motion_px_;
};

}  // namespace clothfit
