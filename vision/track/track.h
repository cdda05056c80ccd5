#pragma once

#include <string>

#include "data/progress.h"
#include "data/recording.h"
#include "vision/ingest/image_source.h"
#include "vision/track/track_options.h"
#include "vision/track/track_result.h"

namespace clothfit {

/// Finds the cloth's tags in every picture of one camera, or its dots and their anchor tags
/// (track_dots.h), or the points of a texture (track_texture.h), where the markers are of that
/// kind. Tags are the markers and reference points that carry a tag and a corner. Pictures come in
/// order, and their tags are read in parallel; the result does not depend on the number of threads.
/// `progress` (may be empty) is called once per picture, in order, by one thread at a time but not
/// always the same. Throws InputError for pictures that cannot be read, are none, or differ in
/// size, for markers without tags, and when no tag of the cloth ever appears.
TrackResult track(const Recording& recording, const CameraEntry& camera,
                  const TrackOptions& options, const ProgressCallback& progress);

/// Finds them in pictures of the camera that are open already.
TrackResult track(const Recording& recording, const CameraEntry& camera, ImageSource& pictures,
                  const TrackOptions& options, const ProgressCallback& progress);

/// Finds them in pictures that come from elsewhere, not those of a texture, which need their
/// camera; refusals call the pictures `where`.
TrackResult track(const Recording& recording, ImageSource& pictures, const std::string& where,
                  const TrackOptions& options, const ProgressCallback& progress);

}  // namespace clothfit
