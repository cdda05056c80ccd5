#pragma once

#include <filesystem>
#include <map>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "data/progress.h"
#include "data/recording.h"
#include "data/tracks.h"

namespace clothfit {

struct TrackOptions {
  double max_speed_px = 60;         ///< a marker further than this from its last place is doubted
  double min_decision_margin = 20;  ///< weaker tag readings are rejected
  void validate() const;            ///< throws InputError
};

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
  int frames = 0;
  int image_width = 0;
  int image_height = 0;
  std::map<std::string, int> rejected;  ///< reason -> count
  cv::Mat overlay;                      ///< one frame with its markers drawn, for the report
  int overlay_frame = 0;
};

/// Finds the cloth's tags in every picture of one camera. Throws InputError for pictures that
/// cannot be read, are none, or differ in size, and when no tag of the family ever appears.
TrackResult track(const Recording& recording, const CameraEntry& camera,
                  const TrackOptions& options, const ProgressCallback& progress);

}  // namespace clothfit
