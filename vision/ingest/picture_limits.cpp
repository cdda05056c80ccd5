#include "vision/ingest/picture_limits.h"

#include <fmt/core.h>

#include <algorithm>

#include "data/input_error.h"

namespace clothfit {

void require_possible_size(const std::string& where, std::int64_t width, std::int64_t height) {
  const bool small = std::min(width, height) < kLeastSide_px;
  // The sides come first, lest their product overflows.
  const bool large = std::max(width, height) > kLongestSide_px || width * height > kMostPixels;
  if (!small && !large) return;
  throw InputError(
      where, fmt::format("the picture is {} x {} px", width, height),
      fmt::format("{} to {} px a side, and at most {:.1f} million pixels in all", kLeastSide_px,
                  kLongestSide_px, static_cast<double>(kMostPixels) / 1e6),
      small ? "give the pictures as the camera took them, not reduced or cut"
            : "shrink all pictures of the camera alike, those of its calibration too");
}

}  // namespace clothfit
