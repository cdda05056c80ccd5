#include "vision/ingest/decode_picture.h"

#include <fmt/core.h>
#include <libexif/exif-data.h>
#include <turbojpeg.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <memory>
#include <sstream>
#include <vector>

#include "data/input_error.h"
#include "vision/ingest/libav.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

struct PictureKind {
  const char* extension;
  AVCodecID codec;
};

constexpr std::array kKinds = {
    PictureKind{".jpg", AV_CODEC_ID_MJPEG}, PictureKind{".jpeg", AV_CODEC_ID_MJPEG},
    PictureKind{".png", AV_CODEC_ID_PNG},   PictureKind{".tif", AV_CODEC_ID_TIFF},
    PictureKind{".tiff", AV_CODEC_ID_TIFF}, PictureKind{".bmp", AV_CODEC_ID_BMP},
    PictureKind{".pgm", AV_CODEC_ID_PGM},   PictureKind{".webp", AV_CODEC_ID_WEBP},
};

const PictureKind* kind_of(const fs::path& file) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const auto found = std::find_if(kKinds.begin(), kKinds.end(), [&](const PictureKind& kind) {
    return extension == kind.extension;
  });
  return found == kKinds.end() ? nullptr : &*found;
}

std::string read_bytes(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in)
    throw InputError(file.string(), fmt::format("cannot be opened: {}", std::strerror(errno)),
                     "a readable file");
  return {std::istreambuf_iterator<char>(in), {}};
}

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

/// Returns what a file holds that is no picture, by its first bytes; empty where that is not known.
std::string other_content(const std::string& bytes) {
  if (bytes.empty()) return "it is empty";
  const bool video = bytes.compare(4, 4, "ftyp") == 0 || bytes.compare(4, 4, "moov") == 0 ||
                     bytes.starts_with("\x1a\x45\xdf\xa3") ||
                     (bytes.starts_with("RIFF") && bytes.compare(8, 4, "AVI ") == 0);
  return video ? "it holds a video, whatever its name says: rename it, to .mp4 for one" : "";
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
  if (std::int64_t{width} * height > libav::kMostPixels) {
    picture.damage = fmt::format("it states a size of {} x {}", width, height);
    return picture;
  }
  if (colours == TJCS_CMYK || colours == TJCS_YCCK)
    throw InputError(file, "the JPEG holds the inks of a print (CMYK)", "a grey or RGB picture",
                     "convert the pictures to sRGB");
  picture.grey.create(height, width, CV_8UC1);
  if (tjDecompress2(decoder.get(), data, size, picture.grey.data, width,
                    static_cast<int>(picture.grey.step), height, TJPF_GRAY, 0) != 0) {
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

}  // namespace

bool is_picture(const fs::path& file) {
  return kind_of(file) != nullptr;
}

DecodedPicture decode_picture(const fs::path& file) {
  const std::string bytes = read_bytes(file);
  const bool jpeg = bytes.starts_with("\xff\xd8");  // whatever the name says
  if (jpeg) return decode_jpeg(bytes, file.string());
  const PictureKind* kind = kind_of(file);
  DecodedPicture picture;
  picture.damage = other_content(bytes);
  if (!picture.damage.empty()) return picture;
  if (kind == nullptr || kind->codec == AV_CODEC_ID_MJPEG) {
    picture.damage = "it is no JPEG";
    return picture;
  }
  const libav::GreyLevels grey =
      libav::decode_still(bytes, kind->codec, file.string(), picture.damage);
  picture.grey = grey.levels;
  picture.bits = grey.bits;
  picture.white_stated = kind->codec == AV_CODEC_ID_PGM && grey.bits == 16 && states_white(bytes);
  return picture;
}

}  // namespace clothfit
