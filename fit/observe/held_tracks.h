#pragma once

#include <vector>

#include "data/recording.h"
#include "data/tracks.h"

namespace clothfit {

struct FitInput;

/// Whether points of the cloth are held that follow their markers (`motion: tracked`).
bool follows_markers(const Recording& recording);

/// The markers that do, in the order of the held points. Throws InputError for a held point
/// without a marker.
std::vector<int> driving_markers(const Recording& recording);

/// Where these markers were in each frame, from pixels: where the rays through their own pixels
/// meet; on a single ray nearest to a guess. That is, in frames that are fitted, their place on a
/// smooth shape of a sheet whose warp and weft hardly stretch, which explains what the cameras see
/// of all markers (fit/observe/shape_from_pixels.h); in held-out frames, whose other markers are to
/// be judged, where they were before. Without sigma. Throws InputError where the pixels do not show
/// the shape in every fitted frame.
Tracks3d held_tracks_from_pixels(const FitInput& input);

}  // namespace clothfit
