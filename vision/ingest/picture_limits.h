#pragma once

#include <cstdint>
#include <string>

namespace clothfit {

/// What pictures and videos may ask for: the one place of these limits, which docs/formats.md
/// repeats.

/// The shortest side of a picture, px. The detectors' windows, and the pyramids that a texture is
/// followed in, need some. A smaller one shows no tag: that has ten cells of two pixels or more.
inline constexpr int kLeastSide_px = 32;

/// The longest side of a picture, px.
inline constexpr int kLongestSide_px = 16384;

/// The most pixels of a picture: 8192 x 8192. Cameras of 61 million pixels and videos of 8K have
/// fewer. Each costs memory: tens of bytes while tags are sought.
inline constexpr std::int64_t kMostPixels = std::int64_t{1} << 26;

/// The most bytes of a picture file: those of the largest picture in colours of 8 bits that are not
/// compressed, and as many for headers as cameras write.
inline constexpr std::uintmax_t kMostPictureBytes =
    3 * std::uintmax_t{kMostPixels} + (std::uintmax_t{1} << 20);

/// Throws InputError where a picture is too small or too large. To be asked with what its header
/// states, before any memory is taken for its pixels.
void require_possible_size(const std::string& where, std::int64_t width, std::int64_t height);

}  // namespace clothfit
