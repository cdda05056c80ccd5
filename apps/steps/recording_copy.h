#pragma once

#include <filesystem>

#include "data/recording.h"

namespace clothfit {

/// Copies the small files of a recording (markers, times, reference points, the obstacle, held
/// paths, tracks, cameras, each to cameras/NAME.yaml) into `folder` and returns the recording as it
/// stands there. Pictures, videos, point clouds and body logs stay where they are and are named by
/// their path. recording.yaml is the caller's to write, after it has added what it found.
Recording copy_recording(const Recording& recording, const std::filesystem::path& folder);

}  // namespace clothfit
