#include "vision/ingest/stated_size.h"

extern "C" {
#include <libavutil/crc.h>
}

#include <array>
#include <charconv>
#include <cstdlib>
#include <optional>

namespace clothfit {
namespace {

constexpr const char* kCutShort = "it is cut short";
constexpr const char* kBadHeader = "its header is damaged";

/// Numbers in the bytes of a file, of either order. What lies beyond the end reads as 0.
struct HeaderBytes {
  std::string_view bytes;
  bool big_endian = false;

  std::uint32_t number(size_t at, size_t length) const {
    std::uint32_t value = 0;
    for (size_t i = 0; i < length; ++i) {
      const size_t place = at + (big_endian ? i : length - 1 - i);
      value = value << 8 | (place < bytes.size() ? static_cast<std::uint8_t>(bytes[place]) : 0U);
    }
    return value;
  }
};

StatedSize unreadable(const char* damage) {
  return {.damage = damage};
}

StatedSize size_of(std::int64_t width, std::int64_t height) {
  if (width <= 0 || height <= 0) return unreadable(kBadHeader);
  return {.width = width, .height = height, .damage = {}};
}

StatedSize size_of_png(std::string_view bytes) {
  constexpr size_t kChunk = 12, kContent = 17, kEnd = kChunk + kContent + 4;  // bytes of IHDR
  if (bytes.size() < kEnd) return unreadable(kCutShort);
  const HeaderBytes header{.bytes = bytes, .big_endian = true};
  const auto* content = reinterpret_cast<const std::uint8_t*>(bytes.data()) + kChunk;
  const std::uint32_t sum = ~av_crc(av_crc_get_table(AV_CRC_32_IEEE_LE), ~0U, content, kContent);
  if (bytes.substr(kChunk, 4) != "IHDR" || header.number(kChunk + kContent, 4) != sum)
    return unreadable(kBadHeader);
  return size_of(header.number(16, 4), header.number(20, 4));
}

/// Returns the value of a TIFF's entry that holds one number. Nothing for other entries.
std::optional<std::uint32_t> tiff_value(const HeaderBytes& header, size_t entry) {
  constexpr std::uint32_t kShort = 3, kLong = 4;
  const std::uint32_t type = header.number(entry + 2, 2);
  if (header.number(entry + 4, 4) != 1) return std::nullopt;
  if (type == kShort) return header.number(entry + 8, 2);
  if (type == kLong) return header.number(entry + 8, 4);
  return std::nullopt;
}

/// Raw camera files are TIFFs as well: their first picture is a preview, or pixels of one colour
/// each.
StatedSize size_of_tiff(std::string_view bytes) {
  const HeaderBytes header{.bytes = bytes, .big_endian = bytes.starts_with('M')};
  const size_t directory = header.number(4, 4);
  if (directory < 8 || directory + 2 > bytes.size()) return unreadable(kCutShort);
  const size_t count = header.number(directory, 2);
  constexpr size_t kEntry = 12;
  if (directory + 2 + count * kEntry > bytes.size()) return unreadable(kCutShort);
  std::int64_t width = 0, height = 0;
  bool raw = false;
  for (size_t i = 0; i < count; ++i) {
    const size_t entry = directory + 2 + i * kEntry;
    constexpr std::uint32_t kSubfile = 254, kWidth = 256, kHeight = 257, kColours = 262,
                            kDngVersion = 50706;
    const std::uint32_t tag = header.number(entry, 2);
    const std::optional<std::uint32_t> value = tiff_value(header, entry);
    if (tag == kWidth) width = value.value_or(0);
    if (tag == kHeight) height = value.value_or(0);
    constexpr std::uint32_t kMosaic = 32803, kLinearRaw = 34892;
    raw = raw || tag == kDngVersion || (tag == kSubfile && (value.value_or(0) & 1) != 0) ||
          (tag == kColours && (value == kMosaic || value == kLinearRaw));
  }
  if (raw) return {.damage = {}, .foreign = "raw camera"};
  return size_of(width, height);
}

StatedSize size_of_bmp(std::string_view bytes) {
  const HeaderBytes header{.bytes = bytes};
  if (bytes.size() < 26) return unreadable(kCutShort);
  const bool old = header.number(14, 4) == 12;
  if (old) return size_of(header.number(18, 2), header.number(20, 2));
  const auto from_above = static_cast<std::int32_t>(header.number(22, 4));
  return size_of(static_cast<std::int32_t>(header.number(18, 4)),
                 std::abs(std::int64_t{from_above}));
}

/// Reads the two numbers after "P5", with comments between.
StatedSize size_of_pgm(std::string_view bytes) {
  std::array<std::int64_t, 2> sides{};
  const char *at = bytes.data() + 2, *end = bytes.data() + bytes.size();
  for (std::int64_t& side : sides) {
    bool comment = false;
    for (; at != end && (comment || *at < '0' || *at > '9'); ++at)
      comment = *at != '\n' && (comment || *at == '#');
    const auto [after, code] = std::from_chars(at, end, side);
    if (code != std::errc()) return unreadable(at == end ? kCutShort : kBadHeader);
    at = after;
  }
  return size_of(sides[0], sides[1]);
}

StatedSize size_of_webp(std::string_view bytes) {
  const HeaderBytes header{.bytes = bytes};
  constexpr size_t kBefore = 8;  // bytes that the stated length leaves out
  if (bytes.size() < 30 || header.number(4, 4) + kBefore > bytes.size())
    return unreadable(kCutShort);
  const std::string_view chunk = bytes.substr(12, 4);
  if (chunk == "VP8 " && bytes.substr(23, 3) == "\x9d\x01\x2a")
    return size_of(header.number(26, 2) & 0x3fff, header.number(28, 2) & 0x3fff);
  if (chunk == "VP8L" && bytes[20] == '\x2f') {
    const std::uint32_t sides = header.number(21, 4);
    return size_of((sides & 0x3fff) + 1, (sides >> 14 & 0x3fff) + 1);
  }
  if (chunk != "VP8X") return unreadable(kBadHeader);
  constexpr std::uint32_t kAnimated = 2;
  if ((header.number(20, 1) & kAnimated) != 0) return {.damage = {}, .foreign = "moving WebP"};
  return size_of(header.number(24, 3) + 1, header.number(27, 3) + 1);
}

}  // namespace

StatedSize stated_size(PictureFormat format, std::string_view bytes) {
  switch (format) {
    case PictureFormat::png:
      return size_of_png(bytes);
    case PictureFormat::tiff:
      return size_of_tiff(bytes);
    case PictureFormat::bmp:
      return size_of_bmp(bytes);
    case PictureFormat::pgm:
      return size_of_pgm(bytes);
    case PictureFormat::webp:
      return size_of_webp(bytes);
    case PictureFormat::jpeg:
      break;  // its own decoder reads the header
  }
  return unreadable(kBadHeader);
}

}  // namespace clothfit
