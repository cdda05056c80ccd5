#include "vision/detect/tag_refine.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cassert>
#include <cmath>
#include <optional>

#include "vision/detect/tag_fit.h"
#include "vision/detect/tag_samples.h"

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

/// Returns small steps from tag coordinates to pixels at the middle of the tag.
Eigen::Matrix2d steps_at_middle(const Eigen::Matrix3d& pixel_from_tag) {
  Eigen::Matrix2d steps;
  steps.col(0) = (mapped(pixel_from_tag, {1, 0}) - mapped(pixel_from_tag, {-1, 0})) / 2;
  steps.col(1) = (mapped(pixel_from_tag, {0, 1}) - mapped(pixel_from_tag, {0, -1})) / 2;
  return steps;
}

}  // namespace

RefinedTag refine_tag(const cv::Mat& grey, const TagPattern& pattern,
                      const Eigen::Matrix3d& pixel_from_tag) {
  assert(grey.type() == CV_8UC1);
  RefinedTag result;
  std::vector<TagSample> samples = tag_samples(grey, pattern, pixel_from_tag);
  constexpr size_t kFewest = 2 * kUnknowns;
  if (samples.size() < kFewest) return result;

  const Eigen::Matrix2d pixel_by_tag = steps_at_middle(pixel_from_tag);
  constexpr double kSharp = 0.5;  // px
  TagFit fit(pattern, pixel_by_tag, samples, PictureBlur::unknowns(kSharp, {0, 0}));
  fit.thin_out();
  if (fit.samples().size() < kFewest) return result;
  constexpr int kMostSteps = 10;
  const bool converged = fit.converge(kMostSteps);
  result.explained = fit.robust().mean();
  result.usable = converged && fit.contrast() > 0;  // white is brighter than black
  if (!result.usable) return result;

  const double left_out = left_out_variance(fit.unknowns(), pixel_by_tag);
  constexpr std::array<std::array<double, 2>, 4> kCorners = {{{-1, 1}, {1, 1}, {1, -1}, {-1, -1}}};
  for (size_t c = 0; c < 4; ++c) {
    const Corner corner =
        corner_of(fit.unknowns(), {kCorners[c][0], kCorners[c][1]}, pixel_from_tag);
    const double variance =
        (corner.by_unknowns * fit.covariance() * corner.by_unknowns.transpose()).trace() / 2;
    result.corner_px[c] = corner.pixel;
    result.sigma_px[c] = std::sqrt(variance + left_out);
    result.usable = result.usable && corner.pixel.allFinite() && std::isfinite(variance);
  }
  return result;
}

}  // namespace clothfit
