#pragma once

#include <string>
#include <vector>

#include "calib/camera/rigid3.h"
#include "data/camera_parameters.h"
#include "data/recording.h"

namespace clothfit {

/// A board as one still shows it. Corners are the pixels of its inner corners, row by row, in the
/// order of the board's own grid: corner r * columns + c lies at (c, r, 0) * square.
struct BoardView {
  std::string name;  ///< of the picture
  std::vector<Eigen::Vector2d> corners_px;
};

struct CalibrateOptions {
  CameraModel model = CameraModel::brown_conrady;
  int distortion_count = 5;   ///< brown_conrady: 4, 5 or 8; more coefficients need more views
  double outlier_sigmas = 5;  ///< corners further off than this many robust sigma are left out
  /// Throws InputError.
  void validate() const;
};

struct ViewError {
  std::string name;
  double rms_px = 0;  ///< per coordinate
  int used = 0;
  int rejected = 0;
  Rigid3 camera_from_board;
};

struct NamedSigma {
  std::string name;  ///< fx, fy, cx, cy, k1, ...
  double value = 0;
  double sigma = 0;
};

struct CalibrateResult {
  bool usable = false;
  std::string message;  ///< one line for a person, also when it failed
  CameraParameters camera;
  std::vector<NamedSigma> intrinsics;  ///< with covariance scaled by the residuals' own variance
  std::vector<ViewError> views;
  double rms_px = 0;  ///< per coordinate over the used corners
  int corners_used = 0;
  int corners_rejected = 0;
};

/// Estimates the intrinsics of a camera from views of one flat board. The start is closed-form,
/// from OpenCV [zhang2000]; Ceres refines intrinsics and one pose per view, with a Cauchy loss
/// first, then by least squares on the corners within `outlier_sigmas`. A view with less than half
/// of its corners good is left out. Sigmas are those of the inverse normal equations times the
/// residuals' variance per degree of freedom. The denominator of brown_conrady with 8 coefficients
/// (k4 k5 k6) is drawn to 0 with a sigma of 1, because lenses with little distortion leave it
/// undetermined.
///
/// The result is not usable, with a message for a person, for fewer than 3 views; for a view with
/// another number of corners than the board; for boards so nearly parallel that the focal length
/// stays open (sigma above 2 %); and for a distortion that folds the picture over itself. Throws
/// InputError only for options that validate() refuses.
CalibrateResult calibrate(const BoardDescription& board, const std::vector<BoardView>& views,
                          int image_width, int image_height, const CalibrateOptions& options);

}  // namespace clothfit
