#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "data/camera_parameters.h"
#include "vision/texture/texture_layout.h"

namespace clothfit {

/// A point of a flat sheet that a picture shows.
struct SheetSighting {
  Eigen::Vector2d on_sheet_m = Eigen::Vector2d::Zero();  ///< (s, t)
  Eigen::Vector2d pixel_px = Eigen::Vector2d::Zero();
  double sigma_px = 0;  ///< > 0, per coordinate
};

/// The homography by which a camera sees a flat sheet: from (s, t) to the picture without the
/// lens's distortion, where the camera is known, else to its pixels.
class FlatSheetView {
 public:
  /// Fits four sightings or more. Nothing where they leave the homography undetermined: too few, on
  /// a line, or beyond where the lens maps.
  static std::optional<FlatSheetView> fit(const std::vector<SheetSighting>& sightings,
                                          const std::optional<CameraParameters>& camera);

  /// Returns the place of (s, t) with its sigma, which grows with the misfit of the sightings.
  /// Nothing where the sheet is seen from behind the horizon there.
  std::optional<FirstPlace> at(const Eigen::Vector2d& on_sheet_m) const;

 private:
  using Unknowns = Eigen::Matrix<double, 8, 1>;

  Eigen::Vector2d scaled(const Eigen::Vector2d& on_sheet_m) const;
  std::optional<Eigen::Vector2d> without_lens(const Eigen::Vector2d& pixel_px) const;
  bool solve(const std::vector<SheetSighting>& sightings);

  std::optional<CameraParameters> camera_;
  double focal_px_ = 1;  ///< px per unit of the picture without distortion
  Eigen::Vector2d middle_m_ = Eigen::Vector2d::Zero();
  double size_m_ = 1;
  Unknowns unknowns_ = Unknowns::Zero();
  Eigen::Matrix<double, 8, 8> covariance_ = Eigen::Matrix<double, 8, 8>::Zero();
};

}  // namespace clothfit
