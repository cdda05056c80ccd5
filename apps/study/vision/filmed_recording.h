#pragma once

#include <filesystem>

#include "data/recording.h"

namespace clothfit {

/// Returns a recording whose first camera has its pictures in a video instead, encoded by H.264 at
/// a constant rate factor. The video is written into `folder`, which is created. Throws InputError
/// for pictures that cannot be read, and where no camera has any.
Recording filmed_evenly(const Recording& recording, int crf, const std::filesystem::path& folder);

/// Returns the same as from a camera that drops pictures: each but the first is lost with a chance
/// of a fifth. The frames are the pictures that remain, with the times that the video states.
Recording filmed_with_gaps(const Recording& recording, int crf, unsigned long long seed,
                           const std::filesystem::path& folder);

}  // namespace clothfit
