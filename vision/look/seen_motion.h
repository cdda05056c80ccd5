#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "data/recording.h"
#include "vision/look/look.h"

namespace clothfit {

/// How far a part of the cloth goes that pictures name: a tag's centre, or a dot.
struct SeenWay {
  Eigen::Vector2d place_m = Eigen::Vector2d::Zero();  ///< on the cloth
  double way_px = 0;                                  ///< largest, from where it was first seen
};

/// How a cloth's tags or dots move over the pictures that were looked at.
struct SeenMotion {
  std::vector<SeenWay> ways;
  double typical_px = 0;  ///< median of the ways
  /// Way from the first frame to the second over that from the second to the third, medians over
  /// tags or dots: 1/3 where a cloth is let go in the first, near 1 in motion, 0 where it
  /// stays. Nothing where these frames were not all looked at.
  std::optional<double> first_step;
  /// Rms distance of the corners or dots in the first picture from a flat sheet, over the sheet's
  /// size in the picture; lens included. Nothing where too few are seen.
  std::optional<double> not_flat;
};

/// Measures how the tags or dots of `markers` move.
SeenMotion measure_motion(const LookResult& seen, const MarkerSet& markers);

}  // namespace clothfit
