#include "vision/detect/picture_blur.h"

#include <Eigen/LU>
#include <cmath>

namespace clothfit {
namespace {

/// Variance of places that are evenly spread over a line of length 1.
constexpr double kLineVariance = 1.0 / 12;

/// Returns sinh(r) / r, and its derivative over r.
std::array<double, 2> sinh_ratio(double r) {
  constexpr double kSmall = 1e-3;  // below it, the series is exact to 1e-13
  if (r < kSmall) return {1 + r * r / 6, 1.0 / 3 + r * r / 30};
  return {std::sinh(r) / r, (r * std::cosh(r) - std::sinh(r)) / (r * r * r)};
}

Eigen::Matrix2d traceless(double s1, double s2) {
  return (Eigen::Matrix2d() << s1, s2, s2, -s1).finished();
}

}  // namespace

PictureBlur::Unknowns PictureBlur::unknowns(double lens_px, const Eigen::Vector2d& motion_px) {
  const double small = lens_px * lens_px;
  const double large = small + kLineVariance * motion_px.squaredNorm();
  const double r = 0.5 * std::log(large / small);
  const double twice = 2 * std::atan2(motion_px.y(), motion_px.x());
  return {0.5 * std::log(large * small), r * std::cos(twice), r * std::sin(twice)};
}

PictureBlur::Unknowns PictureBlur::unknowns(const Eigen::Matrix2d& covariance_px2) {
  const double scale = std::sqrt(covariance_px2.determinant());
  const double along = 0.5 * (covariance_px2(0, 0) - covariance_px2(1, 1)) / scale;
  const double askew = covariance_px2(0, 1) / scale;
  const double per_unknown = sinh_ratio(std::asinh(std::hypot(along, askew)))[0];
  return {std::log(scale), along / per_unknown, askew / per_unknown};
}

PictureBlur::PictureBlur(const Unknowns& unknowns) : unknowns_(unknowns) {
  const double r = std::hypot(unknowns[1], unknowns[2]);
  const double scale = std::exp(unknowns[0]);
  covariance_px2_ = scale * (std::cosh(r) * Eigen::Matrix2d::Identity() +
                             sinh_ratio(r)[0] * traceless(unknowns[1], unknowns[2]));
  lens_variance_px2_ = scale * std::exp(-r);
  const double length = std::sqrt(scale * 2 * std::sinh(r) / kLineVariance);
  const double direction = 0.5 * std::atan2(unknowns[2], unknowns[1]);
  motion_px_ = length * Eigen::Vector2d(std::cos(direction), std::sin(direction));
}

std::array<Eigen::Matrix2d, 3> PictureBlur::covariance_slopes() const {
  const double r = std::hypot(unknowns_[1], unknowns_[2]);
  const double scale = std::exp(unknowns_[0]);
  const auto [ratio, slope_over_r] = sinh_ratio(r);
  const Eigen::Matrix2d turn = traceless(unknowns_[1], unknowns_[2]);
  const Eigen::Matrix2d common = ratio * Eigen::Matrix2d::Identity() + slope_over_r * turn;
  return {covariance_px2_, scale * (unknowns_[1] * common + ratio * traceless(1, 0)),
          scale * (unknowns_[2] * common + ratio * traceless(0, 1))};
}

}  // namespace clothfit
