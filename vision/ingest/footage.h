#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "data/recording.h"
#include "vision/ingest/image_source.h"

namespace clothfit {

/// The pictures of some cameras, each with the frame of the recording that it is.
struct Footage {
  std::map<std::string, std::unique_ptr<ImageSource>> cameras;
  std::vector<double> times_s;  ///< of the frames, by the videos, where the recording states none
  Findings findings;            ///< of times; each source has its own of its pictures
};

/// Opens the pictures of the named cameras, which have some, and numbers their frames. A picture's
/// frame comes from its time where a video states that: on the grid of a declared `frame_rate`, or
/// as the nearest in times.csv. Otherwise pictures count in their order, or by the numbers of their
/// names. Throws InputError where times contradict what is declared, or are missing.
Footage open_footage(const Recording& recording, const std::vector<std::string>& cameras);

}  // namespace clothfit
