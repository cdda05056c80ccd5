#pragma once

#include <filesystem>
#include <memory>

#include "vision/ingest/image_source.h"

namespace clothfit {

/// Opens a video. Its frames are those that its container lists, after edit lists. Throws
/// InputError where there are none, where one has no time, and where the video is interlaced.
std::unique_ptr<ImageSource> open_video(const std::filesystem::path& file);

}  // namespace clothfit
