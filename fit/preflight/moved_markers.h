#pragma once

#include <vector>

#include "fit/preflight/recorded_motion.h"

namespace clothfit {

/// Tells how far markers are from where the first frame shows them, by frame, without what noise
/// makes of it. It is the median over markers: one bad track is no motion.
struct MovedMarkers {
  std::vector<double> distance_m;  ///< NaN where nothing was seen
  std::vector<double> seen_m;      ///< from so far on it is no noise
};
MovedMarkers moved_markers(const RecordedMotion& motion);

}  // namespace clothfit
