#pragma once

#include <filesystem>
#include <memory>

#include "vision/ingest/image_source.h"

namespace clothfit {

/// Opens a folder, a single picture or a video, told by its content. A folder's pictures are
/// ordered by the numbers in their names; names that begin with a dot are passed over. Throws
/// InputError when there is nothing at `path` or it cannot be read, the folder holds no picture or
/// a name that leads to none, the video no frame, or the video is interlaced.
std::unique_ptr<ImageSource> open_images(const std::filesystem::path& path);

}  // namespace clothfit
