#pragma once

#include <string>

#include "data/progress.h"
#include "data/recording.h"
#include "vision/ingest/image_source.h"
#include "vision/track/track_options.h"
#include "vision/track/track_result.h"

namespace clothfit {

/// Finds the dots and anchor tags of a cloth whose markers are of kind `dots` in pictures that come
/// in order (vision/track/dot_tracks.h). Rows of dots are good ones; those of tags' corners are
/// judged as in `track`. Dots that are not found are counted in TrackResult::missing. Reference
/// points are averaged over the pictures that were searched whole. Throws what DotTracker throws,
/// and InputError when no picture shows a dot of the cloth.
TrackResult track_dots(const Recording& recording, ImageSource& pictures, const std::string& where,
                       const TrackOptions& options, const ProgressCallback& progress);

}  // namespace clothfit
