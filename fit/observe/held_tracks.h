#pragma once

#include <vector>

#include "data/recording.h"
#include "data/tracks.h"

namespace clothfit {

struct FitInput;

/// Says whether held points of the cloth follow their markers (`motion: tracked`).
bool follows_markers(const Recording& recording);

/// Returns the markers that drive held points, in the order of these. Throws InputError for a held
/// point without a marker.
std::vector<int> driving_markers(const Recording& recording);

/// Finds where these markers were in each frame, from pixels: where the rays through their own
/// pixels meet. A single ray leaves open how far along it; the point nearest to a guess is taken.
/// In frames that are fitted, the guess is the marker's place on a smooth shape of a sheet whose
/// warp and weft hardly stretch. The shape explains what the cameras see of all markers
/// (fit/observe/shape_from_pixels.h). In held-out frames, whose other markers are to be judged, the
/// guess is the place before. The result has no sigma. Throws InputError where the pixels do not
/// show the shape in every fitted frame.
Tracks3d held_tracks_from_pixels(const FitInput& input);

}  // namespace clothfit
