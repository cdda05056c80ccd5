#pragma once

#include <map>
#include <optional>

#include "data/recording.h"
#include "vision/look/look.h"

namespace clothfit {

/// How a cloth's tags move over the pictures that were looked at.
struct SeenMotion {
  /// Largest way of each tag's centre from where it was first seen (px).
  std::map<int, double> way_px;
  double typical_px = 0;  ///< their median
  /// Way of the centres from the first frame to the second over that from the second to the third,
  /// medians over tags: 1/3 where a cloth is let go in the first, near 1 in motion, 0 where it
  /// stays. Nothing where these frames were not all looked at.
  std::optional<double> first_step;
  /// Rms distance of the first picture's corners from a flat sheet, over the sheet's size in the
  /// picture; lens included. Nothing where too few are seen.
  std::optional<double> not_flat;
};

/// Measures how the tags of `markers` move.
SeenMotion measure_motion(const LookResult& seen, const MarkerSet& markers);

}  // namespace clothfit
