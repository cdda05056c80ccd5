#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace clothfit {

/// A picture file that states a size and holds the beginning of its data, enough for a decoder to
/// begin its work.
struct StatedPicture {
  const char* name;  ///< with the extension of its format
  std::string bytes;
};

/// Returns files of every format that is read, all of which state this size.
std::vector<StatedPicture> pictures_of_size(std::uint32_t width, std::uint32_t height);

/// Returns a chunk of a PNG with its length and checksum.
std::string png_chunk(const std::string& type, const std::string& content);

/// Returns the compressed form of bytes, as PNG and TIFF hold it.
std::string deflated(const std::string& bytes);

}  // namespace clothfit
