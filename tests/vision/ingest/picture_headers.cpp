#include "tests/vision/ingest/picture_headers.h"

#include <zlib.h>

namespace clothfit {
namespace {

std::string little(std::uint32_t value, int length) {
  std::string bytes;
  for (int i = 0; i < length; ++i) bytes += static_cast<char>(value >> (8 * i));
  return bytes;
}

std::string big(std::uint32_t value, int length) {
  const std::string turned = little(value, length);
  return {turned.rbegin(), turned.rend()};
}

std::string png(std::uint32_t width, std::uint32_t height, int bits) {
  const std::string header =
      big(width, 4) + big(height, 4) + static_cast<char>(bits) + std::string(4, '\0');
  return "\x89PNG\r\n\x1a\n" + png_chunk("IHDR", header) +
         png_chunk("IDAT", deflated(std::string(100'000, '\0'))) + png_chunk("IEND", "");
}

std::string jpeg(std::uint32_t width, std::uint32_t height) {
  return "\xff\xd8\xff\xc0" + big(11, 2) + '\x08' + big(height, 2) + big(width, 2) +
         std::string("\x01\x01\x11\x00", 4) + "\xff\xda" + big(8, 2) +
         std::string("\x01\x01\x00\x00\x3f\x00", 6) + std::string(1000, '\x55');
}

std::string tiff(std::uint32_t width, std::uint32_t height) {
  const std::string data = deflated(std::string(100'000, '\0'));
  const auto entry = [](std::uint32_t tag, std::uint32_t value) {
    return little(tag, 2) + little(4, 2) + little(1, 4) + little(value, 4);
  };
  constexpr std::uint32_t kDeflate = 8;
  const std::string entries = entry(256, width) + entry(257, height) + entry(258, 8) +
                              entry(259, kDeflate) + entry(262, 1) + entry(273, 8) + entry(277, 1) +
                              entry(278, height) +
                              entry(279, static_cast<std::uint32_t>(data.size()));
  const auto directory = static_cast<std::uint32_t>(8 + data.size());
  return "II*" + std::string(1, '\0') + little(directory, 4) + data +
         little(static_cast<std::uint32_t>(entries.size() / 12), 2) + entries + little(0, 4);
}

std::string bmp(std::uint32_t width, std::uint32_t height) {
  return "BM" + little(1 << 20, 4) + little(0, 4) + little(54, 4) + little(40, 4) +
         little(width, 4) + little(height, 4) + little(1, 2) + little(24, 2) +
         std::string(24 + 1000, '\0');
}

std::string webp(std::uint32_t width, std::uint32_t height) {
  const std::string sides = little((width - 1) | (height - 1) << 14, 4);
  const std::string chunk = "VP8L" + little(1000, 4) + '\x2f' + sides + std::string(995, '\0');
  return "RIFF" + little(static_cast<std::uint32_t>(4 + chunk.size()), 4) + "WEBP" + chunk;
}

}  // namespace

std::string deflated(const std::string& bytes) {
  uLongf size = compressBound(bytes.size());
  std::string result(size, '\0');
  compress2(reinterpret_cast<Bytef*>(result.data()), &size,
            reinterpret_cast<const Bytef*>(bytes.data()), bytes.size(), 1);
  result.resize(size);
  return result;
}

std::string png_chunk(const std::string& type, const std::string& content) {
  const std::string checked = type + content;
  const auto sum = static_cast<std::uint32_t>(
      crc32(0, reinterpret_cast<const Bytef*>(checked.data()), static_cast<uInt>(checked.size())));
  return big(static_cast<std::uint32_t>(content.size()), 4) + checked + big(sum, 4);
}

std::vector<StatedPicture> pictures_of_size(std::uint32_t width, std::uint32_t height) {
  std::vector<StatedPicture> all = {
      {"8.png", png(width, height, 8)},
      {"1.png", png(width, height, 1)},
      {"a.tif", tiff(width, height)},
      {"a.bmp", bmp(width, height)},
      {"upright.bmp", bmp(width, 0U - height)},
      {"a.pgm", "P5\n# a comment\n" + std::to_string(width) + " " + std::to_string(height) +
                    "\n255\n" + std::string(1000, '\0')}};
  constexpr std::uint32_t kMostJpeg = 65500, kMostWebp = 16383;
  if (width <= kMostJpeg && height <= kMostJpeg) all.push_back({"a.jpg", jpeg(width, height)});
  if (width <= kMostWebp && height <= kMostWebp) all.push_back({"a.webp", webp(width, height)});
  return all;
}

}  // namespace clothfit
