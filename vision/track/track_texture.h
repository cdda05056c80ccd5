#pragma once

#include "data/progress.h"
#include "data/recording.h"
#include "vision/ingest/image_source.h"
#include "vision/track/track_options.h"
#include "vision/track/track_result.h"

namespace clothfit {

/// Follows the markers of a sheet whose markers are of kind `texture` in pictures that come in
/// order (vision/texture/texture_tracker.h), from where they lie in frame 0
/// (vision/texture/first_places.h). Markers that are not found are counted in
/// TrackResult::missing; those with more than `max_sigma_px` are rejected rows. Reference points
/// are averaged over all pictures. Throws what find_first_places throws, and InputError where frame
/// 0 has no whole picture.
TrackResult track_texture(const Recording& recording, const CameraEntry& camera,
                          ImageSource& pictures, const TrackOptions& options,
                          const ProgressCallback& progress);

}  // namespace clothfit
