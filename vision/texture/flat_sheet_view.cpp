#include "vision/texture/flat_sheet_view.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "calib/camera/projection.h"

namespace clothfit {
namespace {

constexpr int kFewestSightings = 4;

/// The image of a scaled place, and its derivative by the homography's eight unknowns.
struct HomographyImage {
  Eigen::Vector2d place;
  Eigen::Matrix<double, 2, 8> by_unknowns;
  double denominator = 0;

  HomographyImage(const Eigen::Matrix<double, 8, 1>& h, const Eigen::Vector2d& x) {
    denominator = h[6] * x.x() + h[7] * x.y() + 1;
    place =
        Eigen::Vector2d(h[0] * x.x() + h[1] * x.y() + h[2], h[3] * x.x() + h[4] * x.y() + h[5]) /
        denominator;
    by_unknowns << x.x(), x.y(), 1, 0, 0, 0, -place.x() * x.x(), -place.x() * x.y(),  //
        0, 0, 0, x.x(), x.y(), 1, -place.y() * x.x(), -place.y() * x.y();
    by_unknowns /= denominator;
  }
};

}  // namespace

Eigen::Vector2d FlatSheetView::scaled(const Eigen::Vector2d& on_sheet_m) const {
  return (on_sheet_m - middle_m_) / size_m_;
}

std::optional<Eigen::Vector2d> FlatSheetView::without_lens(const Eigen::Vector2d& pixel_px) const {
  if (!camera_) return Eigen::Vector2d(pixel_px / focal_px_);
  const std::optional<Eigen::Vector3d> ray = unproject(*camera_, pixel_px);
  if (!ray || !(ray->z() > 0)) return std::nullopt;
  return Eigen::Vector2d(ray->head<2>() / ray->z());
}

bool FlatSheetView::solve(const std::vector<SheetSighting>& sightings) {
  std::vector<Eigen::Vector2d> images;
  for (const SheetSighting& one : sightings) {
    const std::optional<Eigen::Vector2d> image = without_lens(one.pixel_px);
    if (!image) return false;
    images.push_back(*image);
  }
  Eigen::Matrix<double, 8, 8> normal;
  double chi2 = 0;
  constexpr int kIterations = 30;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    normal.setZero();
    Unknowns gradient = Unknowns::Zero();
    chi2 = 0;
    for (size_t i = 0; i < sightings.size(); ++i) {
      const HomographyImage image(unknowns_, scaled(sightings[i].on_sheet_m));
      const double weight = focal_px_ / sightings[i].sigma_px;
      const Eigen::Vector2d residual = weight * (images[i] - image.place);
      const Eigen::Matrix<double, 2, 8> row = weight * image.by_unknowns;
      normal += row.transpose() * row;
      gradient += row.transpose() * residual;
      chi2 += residual.squaredNorm();
    }
    const Unknowns scale = normal.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    const Eigen::LDLT<Eigen::Matrix<double, 8, 8>> solver(scale.asDiagonal() * normal *
                                                          scale.asDiagonal());
    constexpr double kUndetermined = 1e-9;
    // The first iteration starts from a single point, which has no perspective.
    if (!(solver.vectorD().minCoeff() > kUndetermined) && iteration > 0) return false;
    Unknowns step = scale.asDiagonal() * solver.solve(scale.asDiagonal() * gradient).eval();
    if (iteration == 0) step.tail<2>().setZero();
    if (!step.allFinite()) return false;
    unknowns_ += step;
    if (iteration > 0 && step.norm() < 1e-12) break;
  }
  const double freedom = 2 * static_cast<double>(sightings.size()) - 8;
  const double factor = freedom > 0 ? std::max(1.0, chi2 / freedom) : 1;
  covariance_ = factor * normal.ldlt().solve(Eigen::Matrix<double, 8, 8>::Identity());
  return covariance_.allFinite();
}

std::optional<FlatSheetView> FlatSheetView::fit(const std::vector<SheetSighting>& sightings,
                                                const std::optional<CameraParameters>& camera) {
  if (sightings.size() < kFewestSightings) return std::nullopt;
  FlatSheetView view;
  view.camera_ = camera;
  Eigen::Vector2d low_m = sightings[0].on_sheet_m, high_m = low_m;
  Eigen::Vector2d low_px = sightings[0].pixel_px, high_px = low_px;
  for (const SheetSighting& one : sightings) {
    low_m = low_m.cwiseMin(one.on_sheet_m);
    high_m = high_m.cwiseMax(one.on_sheet_m);
    low_px = low_px.cwiseMin(one.pixel_px);
    high_px = high_px.cwiseMax(one.pixel_px);
  }
  view.middle_m_ = 0.5 * (low_m + high_m);
  view.size_m_ = std::max(0.5 * (high_m - low_m).maxCoeff(), 1e-9);
  view.focal_px_ = camera ? camera->focal_px.mean() : std::max(1.0, (high_px - low_px).maxCoeff());
  // It starts as the mean of the sightings, from which an affine map is one step away.
  for (const SheetSighting& one : sightings)
    if (const auto image = view.without_lens(one.pixel_px)) {
      view.unknowns_[2] += image->x() / static_cast<double>(sightings.size());
      view.unknowns_[5] += image->y() / static_cast<double>(sightings.size());
    }
  if (!view.solve(sightings)) return std::nullopt;
  return view;
}

std::optional<FirstPlace> FlatSheetView::at(const Eigen::Vector2d& on_sheet_m) const {
  const HomographyImage image(unknowns_, scaled(on_sheet_m));
  if (!(image.denominator > 0)) return std::nullopt;
  const Eigen::Matrix2d variance = image.by_unknowns * covariance_ * image.by_unknowns.transpose();
  FirstPlace place{.pixel_px = focal_px_ * image.place,
                   .sigma_px = focal_px_ * std::sqrt(0.5 * variance.trace())};
  if (!camera_) return place;
  const auto pixel = project(*camera_, Eigen::Vector3d(image.place.x(), image.place.y(), 1));
  if (!pixel) return std::nullopt;
  place.pixel_px = *pixel;
  return place;
}

}  // namespace clothfit
