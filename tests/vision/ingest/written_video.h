#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <vector>

namespace clothfit {

/// A video to write, one time (s, rising, whole milliseconds) for each picture. The extension of
/// the file says its container, .mp4 or .mkv.
struct WrittenVideo {
  std::vector<cv::Mat> pictures;  ///< CV_8UC1 of one even size
  std::vector<double> times_s;
  const char* encoder = "libx264";
  bool interlaced = false;  ///< says so, top field first
  int turn_deg = 0;         ///< clockwise, asked of players
  int key_every = 12;       ///< pictures
};

void write_video(const WrittenVideo& video, const std::filesystem::path& file);

}  // namespace clothfit
