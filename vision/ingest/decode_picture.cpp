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
    if (tjGetErrorCode(decoder.get()) == TJERR_FATAL) picture.grey.release();
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
  if (kind == nullptr || kind->codec == AV_CODEC_ID_MJPEG) {
    picture.damage = "it is no JPEG";
    return picture;
  }
  const libav::GreyLevels grey =
      libav::decode_still(bytes, kind->codec, file.string(), picture.damage);
  picture.grey = grey.levels;
  picture.bits = grey.bits;
  return picture;
}

}  // namespace clothfit
