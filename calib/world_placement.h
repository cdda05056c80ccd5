#pragma once

#include <string>
#include <vector>

#include "calib/rigid3.h"
#include "data/camera_parameters.h"

namespace clothfit {

/// A point known in some frame, and its pixel.
struct PlacedPixel {
  Eigen::Vector3d point_m = Eigen::Vector3d::Zero();
  Eigen::Vector2d pixel_px = Eigen::Vector2d::Zero();
  double sigma_px = 1;
  int group =
      -1;  ///< points of one rigid flat plate share a group (a tag's four corners); -1: none
};

struct WorldPlacementResult {
  bool usable = false;
  std::string message;
  Rigid3 camera_from_world;
  Eigen::Matrix<double, 6, 6> covariance;  ///< as CameraPose::covariance
  Rigid3 world_from_sheet;                 ///< sheet axes: x along s, y along t, z = x cross y
  bool has_sheet = false;
  double reference_survey_sigma_m = 0;  ///< survey error of the reference points, estimated
  double reference_rms_px = 0;
  double sheet_rms_px = 0;  ///< per coordinate
};

/// Where the camera stands in the world, from fixed reference points whose surveyed places carry
/// errors of their own, and the flat sheet of known size that the first frame shows.
///
/// `reference`: point_m is the surveyed place (world). `sheet`: point_m is (s, t, 0); may be empty.
/// Unknown are the camera's pose, the sheet's pose and every reference point's true place, which
/// is drawn to the survey with a sigma that is estimated from the data. Distrusting the survey this
/// way matters: taken as exact, errors of a millimetre tilt gravity by milliradians and a fit would
/// take that for physics.
WorldPlacementResult place_world(const CameraParameters& camera,
                                 const std::vector<PlacedPixel>& reference,
                                 const std::vector<PlacedPixel>& sheet);

/// Pose of a flat sheet from its pixels alone: camera_from_sheet. At least 4 points.
struct SheetPoseResult {
  bool usable = false;
  std::string message;
  Rigid3 camera_from_sheet;
  double rms_px = 0;
};
SheetPoseResult place_sheet(const CameraParameters& camera, const std::vector<PlacedPixel>& sheet);

}  // namespace clothfit
