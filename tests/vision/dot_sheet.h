#pragma once

#include <vector>

#include "data/markers.h"
#include "vision/detect/dot_pattern.h"

namespace clothfit {

/// Returns a grid of dots `spacing_m` apart from (margin, margin) on, row by row, all without tags.
MarkerSet dot_markers(int columns, int rows, double spacing_m, double margin_m);

/// The same with a tag of tag36h11 in place of the dots two in from the corners: 0 top left, 1 top
/// right, 2 bottom left, 3 bottom right, 1.2 spacings wide.
MarkerSet anchored_dot_markers(int columns, int rows, double spacing_m, double margin_m);

/// Returns the radii of the markers of `dot_markers` that carry a pattern.
std::vector<double> pattern_radii_m(const DotPattern& pattern, double spacing_m);

}  // namespace clothfit
