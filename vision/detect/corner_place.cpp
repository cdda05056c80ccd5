#include "vision/detect/corner_place.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

#include "vision/detect/residual_covariance.h"

namespace clothfit {
namespace {

constexpr int kUnknowns = TagUnknowns::kCount;
constexpr int kTerms = TagUnknowns::kTerms;
constexpr int kBendX = TagUnknowns::kBendX;
constexpr int kBendY = TagUnknowns::kBendY;
using Unknowns = TagUnknowns::Vector;

/// A corner of the border: its pixel, and the pixel's derivative by the unknowns.
struct Corner {
  Eigen::Vector2d pixel;
  Eigen::Matrix<double, 2, kUnknowns> by_unknowns;
};

Corner corner_of(const Unknowns& unknowns, const Eigen::Vector2d& corner,
                 const Eigen::Matrix3d& pixel_from_tag) {
  Eigen::Matrix<double, 2, kTerms> bend;
  bend.row(0) = unknowns.segment<kTerms>(kBendX).transpose();
  bend.row(1) = unknowns.segment<kTerms>(kBendY).transpose();

  // q + d(q) = corner by Newton's method; d is a few hundredths.
  constexpr int kSteps = 5;
  Eigen::Vector2d q = corner;
  Eigen::Matrix2d slope_inverse;
  for (int i = 0; i < kSteps; ++i) {
    slope_inverse =
        (Eigen::Matrix2d::Identity() + bend * TagUnknowns::polynomial_slopes(q.x(), q.y()))
            .inverse();
    q -= slope_inverse * (q + bend * TagUnknowns::polynomials(q.x(), q.y()) - corner);
  }

  const Eigen::Vector3d image = pixel_from_tag * q.homogeneous();
  const Eigen::Vector2d pixel = image.hnormalized();
  const Eigen::Matrix2d pixel_by_q =
      (pixel_from_tag.topLeftCorner<2, 2>() - pixel * pixel_from_tag.block<1, 2>(2, 0)) / image.z();
  const Eigen::Matrix2d pixel_by_bend = -pixel_by_q * slope_inverse;
  const TagUnknowns::Terms terms = TagUnknowns::polynomials(q.x(), q.y());
  Corner result{.pixel = pixel, .by_unknowns = decltype(Corner::by_unknowns)::Zero()};
  result.by_unknowns.middleCols<kTerms>(kBendX) = pixel_by_bend.col(0) * terms.transpose();
  result.by_unknowns.middleCols<kTerms>(kBendY) = pixel_by_bend.col(1) * terms.transpose();
  return result;
}

/// Returns the variance (px^2 per coordinate) that bending of degree 4 and more may add at a
/// corner. It is extrapolated from the two highest degrees found here.
double left_out_variance(const Unknowns& unknowns, const Eigen::Matrix2d& pixel_by_tag) {
  const auto size = [&](int first, int count) {
    Eigen::Matrix2Xd bend(2, count);
    bend.row(0) = unknowns.segment(kBendX + first, count).transpose();
    bend.row(1) = unknowns.segment(kBendY + first, count).transpose();
    return (pixel_by_tag * bend).norm();
  };
  const double ratio = TagUnknowns::kDegreeRatio;
  const double by_third = ratio * size(6, 4), by_second = ratio * ratio * size(3, 3);
  return by_third * by_third + by_second * by_second;
}

using Effects = Eigen::Matrix<double, 8, kUnknowns>;

/// Returns how four points, each with two coordinates, change with the unknowns.
Effects effects_on(const TagUnknowns::Vector& unknowns,
                   const std::array<Eigen::Vector2d, 4>& points,
                   const Eigen::Matrix3d& pixel_from_tag) {
  Effects effects;
  for (size_t c = 0; c < 4; ++c)
    effects.middleRows<2>(2 * static_cast<Eigen::Index>(c)) =
        corner_of(unknowns, points[c], pixel_from_tag).by_unknowns;
  return effects;
}

/// Returns the weight of each residual in the coordinates of four points that stand for the tag and
/// in those of the corners, up to its robust weight, which is shared between it and the residual.
/// The mean over the tag is that over the four points of Gauss's quadrature.
ResidualSums coordinate_sums(const TagFit& fit, const EdgeSamples& edges, const Effects& on_corners,
                             const Eigen::Matrix3d& pixel_from_tag) {
  const double inner = 1 / std::sqrt(3.0);
  const std::array<Eigen::Vector2d, 4> points = {
      {{-inner, -inner}, {inner, -inner}, {inner, inner}, {-inner, inner}}};
  Eigen::Matrix<double, kUnknowns, 16> effects;
  effects.leftCols<8>() = effects_on(fit.unknowns(), points, pixel_from_tag).transpose();
  effects.rightCols<8>() = on_corners.transpose();
  const Eigen::ArrayXf share = edges.rows.weight / edges.rows.robust.sqrt();
  return residual_sums(edges.samples, edges.rows, share,
                       (fit.covariance() * effects).cast<float>());
}

/// Returns the factor that Cauchy's loss brings. An estimate with the influence psi = w r (w:
/// robust weight, r: residual over its sigma) has the variance E[psi^2] / E[psi']^2; from the
/// normal matrix with weights w and residuals sqrt(w) r, one finds E[w r^2] / E[w]. In terms of w,
/// psi' = 2 w^2 - w, psi^2 ~ w - w^2, and w r^2 ~ 1 - w.
double loss_factor(const Eigen::ArrayXd& w) {
  constexpr double kLeastSlope = 0.1;  // hardly anything is explained
  const double slope = std::max((2 * w.square() - w).mean(), kLeastSlope);
  return (w - w.square()).mean() * w.mean() / (slope * slope * (1 - w).mean());
}

/// Returns the variance of the corners' coordinates.
ResidualCovariance::Variances coordinate_variances(const TagFit& fit, const Effects& effects,
                                                   const Eigen::Matrix3d& pixel_from_tag) {
  const Unknowns& prior = fit.prior();
  const ResidualCovariance::Variances by_prior = (effects * fit.covariance()).cwiseAbs2() * prior;
  // Residuals are smaller than errors by what the unknowns take up.
  const auto count = static_cast<double>(fit.samples().count);
  const double taken = kUnknowns - fit.covariance().diagonal().dot(prior);
  const EdgeSamples edges(fit);
  ResidualCovariance covariance(edges);
  return by_prior + loss_factor(fit.robust().cast<double>()) * count /
                        std::max(count - taken, 1.0) *
                        covariance.variance(coordinate_sums(fit, edges, effects, pixel_from_tag));
}

}  // namespace

std::array<Eigen::Vector2d, 4> corner_pixels(const TagFit& fit,
                                             const Eigen::Matrix3d& pixel_from_tag) {
  std::array<Eigen::Vector2d, 4> pixels;
  for (size_t c = 0; c < 4; ++c)
    pixels[c] = corner_of(fit.unknowns(), border_corners()[c], pixel_from_tag).pixel;
  return pixels;
}

std::array<CornerPlace, 4> corner_places(const TagFit& fit, const Eigen::Matrix3d& pixel_from_tag,
                                         const Eigen::Matrix2d& pixel_by_tag) {
  const std::array<Eigen::Vector2d, 4> pixels = corner_pixels(fit, pixel_from_tag);
  const ResidualCovariance::Variances variances = coordinate_variances(
      fit, effects_on(fit.unknowns(), border_corners(), pixel_from_tag), pixel_from_tag);
  const double left_out = left_out_variance(fit.unknowns(), pixel_by_tag);
  std::array<CornerPlace, 4> places;
  for (size_t c = 0; c < 4; ++c)
    places[c] = {.pixel_px = pixels[c],
                 .sigma_px = std::sqrt(
                     variances.segment<2>(2 * static_cast<Eigen::Index>(c)).mean() + left_out)};
  return places;
}

}  // namespace clothfit
