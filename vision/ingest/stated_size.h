#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "vision/ingest/picture_content.h"

namespace clothfit {

/// What the header of a picture states, read without decoding a pixel.
struct StatedSize {
  std::int64_t width = 0;    ///< px
  std::int64_t height = 0;   ///< px
  std::string damage;        ///< what is wrong with the header; the size is then not known
  const char* foreign = "";  ///< the format, where the header tells one that is not read
};

/// Reads the size from the header of a PNG, TIFF, BMP, PGM or WebP file.
StatedSize stated_size(PictureFormat format, std::string_view bytes);

}  // namespace clothfit
