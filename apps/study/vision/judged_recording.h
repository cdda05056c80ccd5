#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <opencv2/core.hpp>
#include <set>
#include <string>
#include <vector>

#include "vision/detect/tag_layout.h"

namespace clothfit {

/// A corner of a tag where it truly is.
struct TrueCorner {
  int tag = 0;
  int corner = 0;
  Eigen::Vector2d pixel_px = Eigen::Vector2d::Zero();
  bool visible = false;  ///< in the picture, and nothing in front of it
};

/// Corners by (tag, corner).
using TrueCorners = std::map<std::pair<int, int>, TrueCorner>;

/// Pictures of one camera of a recording, and where the cloth's tags truly are in each of them.
struct JudgedRecording {
  std::string name;
  std::string family;
  std::vector<cv::Mat> pictures;  ///< 8-bit grey
  std::vector<TrueCorners> truth;
  TagLayout layout;          ///< where the cloth's tags lie on it
  std::set<int> other_tags;  ///< of fixed reference points: in the pictures, and not judged
};

/// Reads the pictures of the first camera of a recording, and truth_tracks2d_CAMERA.csv.gz beside
/// them. Throws InputError where a file is not there or does not fit the pictures.
JudgedRecording read_judged_recording(const std::filesystem::path& folder);

/// Returns the picture files of a folder by name. Throws InputError where it holds none.
std::vector<std::filesystem::path> picture_files(const std::filesystem::path& folder);

/// Reads a picture as 8-bit grey, of 16-bit ones the upper half. Throws InputError.
cv::Mat read_grey(const std::filesystem::path& file);

}  // namespace clothfit
