#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "data/finding.h"

namespace clothfit {

/// The frames that a video's pictures are.
struct FrameNumbers {
  std::vector<int> frame_of_picture;  ///< rising
  Findings findings;                  ///< frames without a picture
};

/// Holds the times that a container states (s, rising) against a declared rate (Hz). A picture's
/// frame is the nearest multiple of the rate's interval, so that one that a camera dropped leaves
/// its frame empty. Throws InputError where the times do not lie on such a grid; `yaml` declares
/// the rate, `video` states the times.
FrameNumbers number_by_rate(const std::vector<double>& times_s, double rate_hz,
                            const std::string& video, const std::string& yaml);

/// Times of a recording whose videos state them.
struct JointTimes {
  std::vector<double> times_s;                               ///< of each frame
  std::map<std::string, std::vector<int>> frame_of_picture;  ///< of each camera, rising
  Findings findings;                                         ///< offsets that were assumed
};

/// Brings the times of several cameras' videos together. Frames are the pictures of the camera that
/// has most, and those that others took where it dropped one. Times are compared as they stand or,
/// where that fails, counted from each camera's first picture. Throws InputError where pictures of
/// two cameras lie further apart than a quarter of an interval either way; `yaml` names the
/// cameras.
JointTimes join_times(const std::map<std::string, std::vector<double>>& times_of_camera_s,
                      const std::string& yaml);

/// Returns the frame of each picture by its time, compared as there; nothing where some picture
/// lies beside all frames.
std::optional<std::vector<int>> number_by_times(const std::vector<double>& frame_times_s,
                                                const std::vector<double>& times_s);

}  // namespace clothfit
