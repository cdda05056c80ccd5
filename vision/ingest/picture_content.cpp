#include "vision/ingest/picture_content.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <string>

#include "data/file_bytes.h"
#include "data/input_error.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;
using namespace std::string_view_literals;
using Kind = PictureContent::Kind;

/// Bytes at a place of a file that tell its format.
struct Mark {
  size_t at = 0;
  std::string_view bytes;
  const char* name = "";
};

constexpr std::array kForeignMarks = {
    Mark{0, "\x76\x2f\x31\x01"sv, "OpenEXR"},
    Mark{0, "\0\0\0\x0cjP  "sv, "JPEG 2000"},
    Mark{0, "\xff\x4f\xff\x51"sv, "JPEG 2000"},
    Mark{0, "\0\0\0\x0cJXL "sv, "JPEG XL"},
    Mark{0, "\xff\x0a"sv, "JPEG XL"},
    Mark{0, "#?RADIANCE"sv, "Radiance HDR"},
    Mark{0, "#?RGBE"sv, "Radiance HDR"},
    Mark{128, "DICM"sv, "DICOM"},
    Mark{0, "8BPS"sv, "Photoshop"},
    Mark{0, "GIF8"sv, "GIF"},
    Mark{0, "SIMPLE  ="sv, "FITS"},
    Mark{0, "SDPX"sv, "DPX"},
    Mark{0, "XPDS"sv, "DPX"},
    Mark{0, "DDS "sv, "DDS"},
    Mark{0, "qoif"sv, "QOI"},
    Mark{0, "%PDF-"sv, "PDF"},
    Mark{0, "II+\0"sv, "BigTIFF"},
    Mark{0, "MM\0+"sv, "BigTIFF"},
    Mark{8, "CR\x02"sv, "raw camera"},
    Mark{0, "IIRO"sv, "raw camera"},
    Mark{0, "IIRS"sv, "raw camera"},
    Mark{0, "MMOR"sv, "raw camera"},
    Mark{0, "IIU\0"sv, "raw camera"},
    Mark{0, "FUJIFILMCCD-RAW"sv, "raw camera"},
    Mark{0, "FOVb"sv, "raw camera"},
    Mark{6, "HEAPCCDR"sv, "raw camera"},
};

/// Brands of the ISO container that stand for stills. All others are taken for videos.
constexpr std::array kForeignBrands = {
    Mark{8, "heic"sv, "HEIC"}, Mark{8, "heix"sv, "HEIC"},       Mark{8, "heim"sv, "HEIC"},
    Mark{8, "heis"sv, "HEIC"}, Mark{8, "hevc"sv, "HEIC"},       Mark{8, "hevx"sv, "HEIC"},
    Mark{8, "mif1"sv, "HEIC"}, Mark{8, "msf1"sv, "HEIC"},       Mark{8, "avif"sv, "AVIF"},
    Mark{8, "avis"sv, "AVIF"}, Mark{8, "crx "sv, "raw camera"},
};

constexpr std::array kPictureNames = {".jpg"sv,  ".jpeg"sv, ".jfif"sv, ".png"sv, ".tif"sv,
                                      ".tiff"sv, ".bmp"sv,  ".pgm"sv,  ".webp"sv};

constexpr std::array kForeignNames = {
    ".heic"sv, ".heif"sv, ".hif"sv, ".avif"sv, ".exr"sv, ".jp2"sv, ".j2k"sv, ".jpx"sv,
    ".jxl"sv,  ".dcm"sv,  ".psd"sv, ".gif"sv,  ".ppm"sv, ".pbm"sv, ".pam"sv, ".tga"sv,
    ".dpx"sv,  ".dds"sv,  ".qoi"sv, ".fits"sv, ".dng"sv, ".cr2"sv, ".cr3"sv, ".nef"sv,
    ".arw"sv,  ".orf"sv,  ".rw2"sv, ".raf"sv,  ".pef"sv, ".srw"sv};

bool stands_at(const Mark& mark, std::string_view bytes) {
  return bytes.size() >= mark.at + mark.bytes.size() &&
         bytes.substr(mark.at, mark.bytes.size()) == mark.bytes;
}

template <size_t Count>
const Mark* find_mark(const std::array<Mark, Count>& marks, std::string_view bytes) {
  const auto found =
      std::ranges::find_if(marks, [&](const Mark& mark) { return stands_at(mark, bytes); });
  return found == marks.end() ? nullptr : &*found;
}

/// Says whether a bitmap's headers follow its two letters, with which a text may begin.
bool is_bitmap(std::string_view bytes) {
  if (!bytes.starts_with("BM") || bytes.size() < 18 || bytes.substr(15, 3) != "\0\0\0"sv)
    return false;
  constexpr std::array kHeaders = {12, 40, 52, 56, 64, 108, 124};  // bytes
  return std::ranges::find(kHeaders, static_cast<std::uint8_t>(bytes[14])) != kHeaders.end();
}

/// Returns the digit of Netpbm's "P5" and a blank; 0 where that is not what the bytes begin with.
char netpbm_kind(std::string_view bytes) {
  const bool known = bytes.size() > 2 && bytes[0] == 'P' && bytes[1] >= '1' && bytes[1] <= '7' &&
                     (std::isspace(static_cast<unsigned char>(bytes[2])) != 0 || bytes[2] == '#');
  return known ? bytes[1] : '\0';
}

/// Says whether a name ends in one of some extensions, in letters of either case.
template <size_t Count>
bool ends_in(const fs::path& file, const std::array<std::string_view, Count>& extensions) {
  std::string extension = file.extension().string();
  std::ranges::transform(extension, extension.begin(), [](unsigned char letter) {
    return static_cast<char>(std::tolower(letter));
  });
  return std::ranges::find(extensions, extension) != extensions.end();
}

PictureContent read_format(PictureFormat format) {
  return {.kind = Kind::picture, .format = format};
}

PictureContent foreign_format(const char* name) {
  return {.kind = Kind::foreign, .name = name};
}

}  // namespace

PictureContent content_of_bytes(std::string_view bytes) {
  if (bytes.empty()) return {.kind = Kind::empty};
  if (const Mark* mark = find_mark(kForeignMarks, bytes)) return foreign_format(mark->name);
  if (bytes.starts_with("\xff\xd8")) return read_format(PictureFormat::jpeg);
  if (bytes.starts_with("\x89PNG\r\n\x1a\n")) return read_format(PictureFormat::png);
  if (bytes.starts_with("II*\0"sv) || bytes.starts_with("MM\0*"sv))
    return read_format(PictureFormat::tiff);
  if (is_bitmap(bytes)) return read_format(PictureFormat::bmp);
  if (const char kind = netpbm_kind(bytes))
    return kind == '5' ? read_format(PictureFormat::pgm)
                       : foreign_format(kind == '2' ? "text PGM" : "PBM, PPM or PAM");
  const bool riff = bytes.starts_with("RIFF");
  if (riff && stands_at({8, "WEBP"sv}, bytes)) return read_format(PictureFormat::webp);
  if (bytes.size() >= 12 && stands_at({4, "ftyp"sv}, bytes)) {
    const Mark* still = find_mark(kForeignBrands, bytes);
    return still != nullptr ? foreign_format(still->name) : PictureContent{.kind = Kind::video};
  }
  const bool video = stands_at({4, "moov"sv}, bytes) || bytes.starts_with("\x1a\x45\xdf\xa3") ||
                     (riff && stands_at({8, "AVI "sv}, bytes));
  return {.kind = video ? Kind::video : Kind::unknown};
}

PictureContent content_of_file(const fs::path& file) {
  FileBytes in(file);
  std::string bytes(kContentBytes, '\0');
  size_t filled = 0;
  while (const size_t count = in.read(bytes.data() + filled, bytes.size() - filled))
    filled += count;
  return content_of_bytes(std::string_view(bytes).substr(0, filled));
}

bool has_picture_name(const fs::path& file) {
  return ends_in(file, kPictureNames);
}

bool has_foreign_picture_name(const fs::path& file) {
  return ends_in(file, kForeignNames);
}

void refuse_foreign_picture(const fs::path& file, const char* format) {
  throw InputError(file.string(), fmt::format("it holds {} data, which are not read", format),
                   kReadFormats, "convert the pictures to PNG or JPEG, all of them alike");
}

}  // namespace clothfit
