#pragma once

// Private to calib/: the least-squares problem inside calibrate().

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "calib/bundle/pose_block.h"
#include "calib/camera/projection.h"
#include "data/camera_parameters.h"

namespace clothfit {

/// The given data: a flat board's corners, and where each view shows them.
struct BoardObservations {
  std::vector<Eigen::Vector2d> on_board_m;                ///< corners of the board, z = 0
  std::vector<const std::vector<Eigen::Vector2d>*> seen;  ///< per view, px
  double image_width = 0;
  double image_height = 0;
};

/// The unknowns, and which of the observations take part.
struct CameraEstimate {
  CameraModel model = CameraModel::pinhole;
  int distortion_count = 0;
  std::array<double, kMaxIntrinsics> intrinsics{};
  std::vector<PoseBlock> camera_from_board;  ///< one per view
  std::vector<std::vector<char>> used;       ///< per view and corner
  double corner_sigma_px = 0.1;              ///< weighs the corners against RationalPrior

  int intrinsics_count() const { return 4 + distortion_count; }
  /// Says whether any corner of the view takes part.
  bool is_active(size_t view) const;
};

/// Refines intrinsics and poses by least squares on the used corners, under a Cauchy loss of this
/// scale (0: none). Returns false when the solver failed.
bool refine_camera(const BoardObservations& observations, double cauchy_scale_px,
                   CameraEstimate& estimate);

/// Returns observed minus projected, px, for every corner of a view; infinite where it lies behind
/// the camera.
std::vector<Eigen::Vector2d> view_residuals(const BoardObservations& observations,
                                            const CameraEstimate& estimate, size_t view);

/// Estimates the robust standard deviation per coordinate over all corners, good or bad, of the
/// active views.
double robust_sigma_px(const BoardObservations& observations, const CameraEstimate& estimate);

/// Returns the standard deviations of the intrinsics: the inverse of the normal equations, times
/// the variance per coordinate. Nothing when the normal equations are singular.
std::optional<Eigen::VectorXd> intrinsic_sigmas(const BoardObservations& observations,
                                                double variance_px2, CameraEstimate& estimate);

CameraParameters to_camera(const BoardObservations& observations, const CameraEstimate& estimate);

}  // namespace clothfit
