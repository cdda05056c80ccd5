#pragma once

#include <filesystem>
#include <string_view>

namespace clothfit {

enum class PictureFormat { jpeg, png, tiff, bmp, pgm, webp };

/// What a file holds, whatever its name says.
struct PictureContent {
  enum class Kind {
    picture,  ///< of a format that is read here
    foreign,  ///< a picture of a format that is not
    video,
    empty,
    unknown
  };
  Kind kind = Kind::unknown;
  PictureFormat format = PictureFormat::jpeg;  ///< of a picture
  const char* name = "";                       ///< of the format of a foreign one
};

/// The formats that are read, as messages list them.
inline constexpr const char* kReadFormats = "JPEG, PNG, TIFF, BMP, PGM or WebP";

/// How many bytes from the beginning of a file `content_of_bytes` looks at.
inline constexpr size_t kContentBytes = 512;

/// Tells content by its first bytes.
PictureContent content_of_bytes(std::string_view first_bytes);

/// Tells the content of a file. Throws InputError where it is none or cannot be read.
PictureContent content_of_file(const std::filesystem::path& file);

/// Says whether a name ends as those of pictures do that are read here.
bool has_picture_name(const std::filesystem::path& file);

/// Says whether a name ends as those of pictures do that are not read here.
bool has_foreign_picture_name(const std::filesystem::path& file);

/// Refuses a picture of a format that is not read, by its name.
[[noreturn]] void refuse_foreign_picture(const std::filesystem::path& file, const char* format);

}  // namespace clothfit
