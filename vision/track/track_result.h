#pragma once

#include <Eigen/Core>
#include <map>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "data/finding.h"
#include "data/tracks.h"

namespace clothfit {

/// The mean place of a fixed reference point over all frames that show it.
struct ReferencePixel {
  int point = 0;  ///< index into Recording::reference
  Eigen::Vector2d pixel_px = Eigen::Vector2d::Zero();
  double sigma_px = 0;  ///< of the mean, systematic part of one detection included
  int frames = 0;
};

struct TrackResult {
  bool usable = false;
  bool cancelled = false;
  std::string message;
  Tracks2d tracks;  ///< good and rejected rows of the cloth's markers
  std::vector<ReferencePixel> reference;
  Findings footage;  ///< what the pictures' files and the pictures themselves show to be wrong
  int frames = 0;    ///< up to the last one that has a picture
  int image_width = 0;
  int image_height = 0;
  std::map<std::string, int> rejected;  ///< reason (vision/track/rejection.h) -> rows of `tracks`
  /// Expected and in no row: reason (vision/track/missing_markers.h, of
  /// dots also vision/track/dot_tracks.h) -> markers times frames.
  std::map<std::string, int> missing;
  cv::Mat overlay;  ///< one frame with its markers drawn, for the report
  int overlay_frame = 0;
};

}  // namespace clothfit
