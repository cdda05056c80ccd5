#include "vision/ingest/decode_picture.h"

#include <fmt/core.h>
#include <libexif/exif-data.h>
#include <turbojpeg.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <memory>
#include <sstream>
#include <string_view>
#include <utility>
#include <vector>

#include "data/file_bytes.h"
#include "data/input_error.h"
#include "vision/ingest/libav.h"
#include "vision/ingest/picture_content.h"
#include "vision/ingest/picture_limits.h"
#include "vision/ingest/stated_size.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

/// Notes the turn that EXIF's orientation asks a viewer for.
void read_turn(const std::string& bytes, DecodedPicture& picture) {
  const std::unique_ptr<ExifData, void (*)(ExifData*)> exif(
      exif_data_new_from_data(reinterpret_cast<const unsigned char*>(bytes.data()),
                              static_cast<unsigned>(bytes.size())),
      exif_data_unref);
  if (!exif) return;
  const ExifEntry* entry = exif_content_get_entry(exif->ifd[EXIF_IFD_0], EXIF_TAG_ORIENTATION);
  if (entry == nullptr || entry->size < 2) return;
  const int orientation = exif_get_short(entry->data, exif_data_get_byte_order(exif.get()));
  constexpr std::array kTurns = {0, 0, 180, 180, 270, 90, 90, 270};  // of orientations 1 to 8
  if (orientation < 1 || orientation > 8) return;
  picture.turn_deg = kTurns[static_cast<size_t>(orientation - 1)];
  picture.flipped = orientation == 2 || orientation == 4 || orientation == 5 || orientation == 7;
}

/// Says whether libjpeg warns of nothing but oddities that cost no pixel. `message` is its last
/// warning. What follows the last marker of the data comes too late to spoil them, but may hide an
/// earlier warning, so that the first one is asked for.
bool is_harmless(const std::string& message, const std::string& bytes, cv::Mat& scratch) {
  for (const char* oddity : {"Invalid SOS parameters", "Unknown Adobe color transform",
                             "Warning: unknown JFIF revision"})
    if (message.find(oddity) != std::string::npos) return true;
  constexpr const char* kBeforeTheEnd = "extraneous bytes before marker 0xd9";
  if (message.find(kBeforeTheEnd) == std::string::npos) return false;
  const std::unique_ptr<void, int (*)(tjhandle)> decoder(tjInitDecompress(), tjDestroy);
  tjDecompress2(decoder.get(), reinterpret_cast<const unsigned char*>(bytes.data()),
                static_cast<unsigned long>(bytes.size()), scratch.data, scratch.cols,
                static_cast<int>(scratch.step), scratch.rows, TJPF_GRAY, TJFLAG_STOPONWARNING);
  return std::string(tjGetErrorStr2(decoder.get())).find(kBeforeTheEnd) != std::string::npos;
}

/// Says what a file holds that is no picture.
std::string no_picture(PictureContent::Kind kind) {
  if (kind == PictureContent::Kind::empty) return "it is empty";
  if (kind == PictureContent::Kind::video)
    return "it holds a video, whatever its name says: rename it, to .mp4 for one";
  return fmt::format("it is no {}", kReadFormats);
}

/// Leaves those chunks of a PNG that make its pixels. Compressed texts among the others may unfold
/// to any size.
void leave_pixels(std::string& bytes) {
  constexpr size_t kSignature = 8, kAround = 12;  // bytes; a chunk's length, type and checksum
  size_t from = kSignature, to = kSignature;
  while (bytes.size() - from >= kAround) {
    std::uint32_t length = 0;
    for (size_t i = 0; i < 4; ++i)
      length = length << 8 | static_cast<std::uint8_t>(bytes[from + i]);
    const std::string_view type = std::string_view(bytes).substr(from + 4, 4);
    const bool kept =
        type == "IHDR" || type == "PLTE" || type == "tRNS" || type == "IDAT" || type == "IEND";
    const size_t whole = std::min(kAround + size_t{length}, bytes.size() - from);
    if (kept) {
      std::memmove(bytes.data() + to, bytes.data() + from, whole);
      to += whole;
    }
    from += whole;
  }
  bytes.resize(to);
}

/// Says whether a PGM states a white level of its own, which its decoder then brings to 16 bits.
/// One of 65535 may hold fewer bits.
bool states_white(const std::string& bytes) {
  std::istringstream header(bytes.substr(0, 512));
  std::string word;
  std::vector<std::string> words;
  while (words.size() < 4 && header >> word) {
    if (word.starts_with('#'))
      std::getline(header, word);
    else
      words.push_back(word);
  }
  return words.size() == 4 && words[0] == "P5" && words[3] != "65535";
}

DecodedPicture decode_jpeg(const std::string& bytes, const std::string& file) {
  DecodedPicture picture;
  const std::unique_ptr<void, int (*)(tjhandle)> decoder(tjInitDecompress(), tjDestroy);
  const auto* data = reinterpret_cast<const unsigned char*>(bytes.data());
  const auto size = static_cast<unsigned long>(bytes.size());
  int width = 0, height = 0, subsampling = 0, colours = 0;
  if (tjDecompressHeader3(decoder.get(), data, size, &width, &height, &subsampling, &colours) !=
          0 &&
      tjGetErrorCode(decoder.get()) == TJERR_FATAL) {
    picture.damage = tjGetErrorStr2(decoder.get());
    return picture;
  }
  require_possible_size(file, width, height);
  if (colours == TJCS_CMYK || colours == TJCS_YCCK)
    throw InputError(file, "the JPEG holds the inks of a print (CMYK)", "a grey or RGB picture",
                     "convert the pictures to sRGB");
  picture.grey.create(height, width, CV_8UC1);
  if (tjDecompress2(decoder.get(), data, size, picture.grey.data, width,
                    static_cast<int>(picture.grey.step), height, TJPF_GRAY,
                    TJFLAG_LIMITSCANS) != 0) {
    picture.damage = tjGetErrorStr2(decoder.get());
    if (tjGetErrorCode(decoder.get()) == TJERR_FATAL) {
      picture.grey.release();
    } else {
      cv::Mat scratch(picture.grey.size(), CV_8UC1);
      if (is_harmless(picture.damage, bytes, scratch)) picture.damage.clear();
    }
  }
  read_turn(bytes, picture);
  return picture;
}

AVCodecID codec_of(PictureFormat format) {
  switch (format) {
    case PictureFormat::jpeg:
      return AV_CODEC_ID_MJPEG;
    case PictureFormat::png:
      return AV_CODEC_ID_PNG;
    case PictureFormat::tiff:
      return AV_CODEC_ID_TIFF;
    case PictureFormat::bmp:
      return AV_CODEC_ID_BMP;
    case PictureFormat::pgm:
      return AV_CODEC_ID_PGM;
    case PictureFormat::webp:
      return AV_CODEC_ID_WEBP;
  }
  return AV_CODEC_ID_NONE;
}

/// Decodes a picture that is no JPEG, once its header is known to state a possible size.
DecodedPicture decode_other(PictureFormat format, std::string bytes, const fs::path& file) {
  DecodedPicture picture;
  const StatedSize stated = stated_size(format, bytes);
  if (*stated.foreign != '\0') refuse_foreign_picture(file, stated.foreign);
  picture.damage = stated.damage;
  if (!picture.damage.empty()) return picture;
  require_possible_size(file.string(), stated.width, stated.height);
  const bool pgm = format == PictureFormat::pgm;
  const bool white_stated = pgm && states_white(bytes);
  if (format == PictureFormat::png) leave_pixels(bytes);
  const libav::GreyLevels grey =
      libav::decode_still(std::move(bytes), codec_of(format), file.string(), picture.damage);
  if (!grey.levels.empty() &&
      (grey.levels.cols != stated.width || grey.levels.rows != stated.height)) {
    picture.damage = fmt::format("its header states {} x {} px, its data {} x {}", stated.width,
                                 stated.height, grey.levels.cols, grey.levels.rows);
    return picture;
  }
  picture.grey = grey.levels;
  picture.bits = grey.bits;
  picture.white_stated = white_stated && grey.bits == 16;
  return picture;
}

}  // namespace

DecodedPicture decode_picture(const fs::path& file) {
  std::string bytes = read_file_bytes(file, kMostPictureBytes);
  const PictureContent content = content_of_bytes(bytes);
  if (content.kind == PictureContent::Kind::foreign) refuse_foreign_picture(file, content.name);
  DecodedPicture picture;
  if (content.kind != PictureContent::Kind::picture) {
    picture.damage = no_picture(content.kind);
    return picture;
  }
  if (content.format == PictureFormat::jpeg) return decode_jpeg(bytes, file.string());
  return decode_other(content.format, std::move(bytes), file);
}

}  // namespace clothfit
