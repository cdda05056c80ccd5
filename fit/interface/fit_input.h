#pragma once

#include <map>
#include <string>
#include <vector>

#include "data/camera_parameters.h"
#include "data/clouds.h"
#include "data/recording.h"
#include "data/tracks.h"

namespace clothfit {

/// All input of a fit, read in.
struct FitInput {
  Recording recording;
  Tracks3d tracks3d;                         ///< empty when there are none
  std::map<std::string, Tracks2d> tracks2d;  ///< camera name -> its tracks
  std::vector<CameraParameters> cameras;     ///< those of tracks2d, with poses
  /// Tracks of the markers that drive held points, where there are no 3D tracks
  /// (fit/observe/held_tracks.h).
  Tracks3d held_tracks;
  PointClouds clouds;  ///< world; errors are judged by them, nothing is fitted
};

}  // namespace clothfit
