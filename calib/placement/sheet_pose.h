#pragma once

#include <string>
#include <vector>

#include "calib/bundle/placed_pixel.h"
#include "calib/camera/rigid3.h"
#include "data/camera_parameters.h"

namespace clothfit {

struct SheetPoseResult {
  bool usable = false;
  std::string message;  ///< one line for a person, also when it failed
  Rigid3 camera_from_sheet;
  double rms_px = 0;  ///< per coordinate, over the points that took part
};

/// Finds the pose of a flat sheet from its pixels alone. There are at least 4 points; point_m is
/// (s, t, 0). A flat figure looks nearly alike under two poses: both are refined and the better one
/// is kept. Points beyond 5 robust sigma of it take no part.
SheetPoseResult place_sheet(const CameraParameters& camera, const std::vector<PlacedPixel>& sheet);

}  // namespace clothfit
