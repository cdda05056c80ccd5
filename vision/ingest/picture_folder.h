#pragma once

#include <filesystem>
#include <memory>

#include "vision/ingest/image_source.h"

namespace clothfit {

/// Opens a folder of pictures. Throws InputError where it holds none.
std::unique_ptr<ImageSource> open_picture_folder(const std::filesystem::path& folder);

/// Opens a single picture file.
std::unique_ptr<ImageSource> open_picture(const std::filesystem::path& file);

}  // namespace clothfit
