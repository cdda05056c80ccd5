#pragma once

#include <string>
#include <vector>

#include "calib/bundle/placed_pixel.h"
#include "calib/camera/rigid3.h"
#include "data/camera_parameters.h"

namespace clothfit {

struct WorldPlacementResult {
  bool usable = false;
  std::string message;  ///< one line for a person, also when it failed
  Rigid3 camera_from_world;
  Eigen::Matrix<double, 6, 6> covariance =
      Eigen::Matrix<double, 6, 6>::Zero();  ///< as CameraPose::covariance
  Rigid3 world_from_sheet;                  ///< sheet axes: x along s, y along t, z = x cross y
  bool has_sheet = false;
  double reference_survey_sigma_m = 0;  ///< survey error per coordinate, estimated
  double reference_rms_px = 0;          ///< per coordinate, of the places as surveyed
  int reference_rejected = 0;           ///< points that contradict the others by centimetres
  double sheet_rms_px = 0;              ///< per coordinate
};

/// Estimates where the camera stands in the world, and the flat sheet of known size in the first
/// frame. The fixed reference points have surveyed places that carry errors of their own.
///
/// `reference`: point_m is the surveyed place (world), at least 4, not on a line. `sheet`: point_m
/// is (s, t, 0); may be empty.
///
/// Unknown are the camera's pose, the sheet's pose and every reference point's true place, which is
/// drawn to the survey with a sigma that is estimated from the data. The survey is not taken as
/// exact, because errors of a millimetre would then tilt gravity by milliradians and a fit would
/// take that for physics. The sheet's place in the world is free, so it shares only the camera's
/// pose with the reference. The joint optimum is therefore the reference's camera with the sheet
/// that place_sheet (sheet_pose.h) finds.
///
/// The minimum of
///   sum |pixel - project(camera_from_world X_i)|^2 / (f sigma_px)^2 + sum |X_i - survey_i|^2 / s^2
/// with, for the corners of a tag, X = world_from_tag * (+-a/2, +-a/2, 0). Tags are squares of
/// unknown side a. The sides of tags that the survey cannot tell apart (4 sigma) are drawn to a
/// common one with a relative sigma of 0.1 %, the accuracy of a printer. The common side matters
/// most for the weakest direction, the turn about the camera's x axis, because apparent sizes tell
/// depths. Over 300 scenes like the bundled one (five 70 mm tags, 1 mm survey error, 0.1 px) its
/// rms error is 5.1 mrad without squares, 4.3 with a free side for each tag, 2.7 with a common one.
///
/// Points further from the robust start than 8 robust spreads are left out first.
///
/// s is one for all survey coordinates. f is one for all corners of tags, >= 1: paper is not quite
/// flat and prints are not quite alike. Both are variance components, estimated by iterating
///   s^2 <- s^2 * (sum of squared standardised residuals) / (redundancy),
/// where the redundancy is the number of these residuals less the trace of their part of the hat
/// matrix; at the fixed point this is the REML estimate [patterson1971]. The covariance is the
/// inverse of the normal equations at these values.
WorldPlacementResult place_world(const CameraParameters& camera,
                                 const std::vector<PlacedPixel>& reference,
                                 const std::vector<PlacedPixel>& sheet);

}  // namespace clothfit
