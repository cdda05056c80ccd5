#pragma once

#include <filesystem>

#include "data/recording.h"

namespace clothfit {

/// Copies the small files of a recording into `folder` and returns the recording as it stands
/// there. These are markers, times, reference points, the obstacle, held paths, tracks, and cameras
/// (each to cameras/NAME.yaml). Pictures, videos, point clouds and body logs stay where they are
/// and are named by their path. The caller writes recording.yaml, after it has added its results.
Recording copy_recording(const Recording& recording, const std::filesystem::path& folder);

}  // namespace clothfit
