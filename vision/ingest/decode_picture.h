#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <string>

namespace clothfit {

/// A picture file as the sensor wrote it: a turn that its metadata asks for is not applied.
struct DecodedPicture {
  cv::Mat grey;  ///< CV_8UC1 for 8 bits, else CV_16UC1; 0 is black, 2^bits - 1 white
  int bits = 8;
  bool white_stated = false;  ///< the file says what white is; else levels of 16 bits may use fewer
  int turn_deg = 0;           ///< clockwise, asked for by EXIF; 0 where none is
  bool flipped = false;       ///< EXIF asks for a mirrored picture
  std::string damage;         ///< what is wrong with the file; `grey` may then be empty
};

/// Decodes a JPEG, PNG, TIFF, BMP, PGM or WebP file, told by its content. Luma of a colour picture
/// is its grey. Throws InputError for a file that cannot be read, for other formats (HEIC), for a
/// size beyond picture_limits.h, and for a kind that has no grey of its own: CMYK, or partly
/// transparent. Nothing is printed.
DecodedPicture decode_picture(const std::filesystem::path& file);

}  // namespace clothfit
