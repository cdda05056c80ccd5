#pragma once

#include <array>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "vision/detect/tag_detector.h"

namespace clothfit {

struct TrackOptions;

/// One reading of a tag. `rejected` says why corners are doubted; empty where they are not.
struct TagReading {
  int frame = 0;
  TagDetection tag;
  std::array<std::string, 4> rejected;  ///< a code of vision/track/rejection.h per corner

  /// Says whether any corner is left.
  bool good() const;
  /// Rejects the corners that are not rejected yet.
  void reject(const char* reason);
  Eigen::Vector2d centre_px() const;
};

/// The readings of one tag, sorted by frame.
using TagHistory = std::vector<TagReading>;

/// Rejects a reading, or corners of it, for the reasons that show in one picture alone. `size` is
/// that of the picture.
void judge_alone(TagReading& reading, const TrackOptions& options, const cv::Size& size);

/// Rejects readings and corners that one picture shows to be doubtful, tags read twice in a
/// picture, and tags that jump. One reading per frame stays. `size` is that of the pictures.
void judge(TagHistory& history, const TrackOptions& options, const cv::Size& size);

}  // namespace clothfit
