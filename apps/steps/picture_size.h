#pragma once

#include <filesystem>
#include <string>

namespace clothfit {

struct PictureSize {
  int width = 0;   ///< px
  int height = 0;  ///< px
  bool operator==(const PictureSize&) const = default;
};

/// Returns the size of the first picture of a folder or video. Throws InputError where there is
/// none.
PictureSize picture_size(const std::filesystem::path& images);

/// Returns "960 x 720 px".
std::string to_string(const PictureSize& size);

}  // namespace clothfit
