#pragma once

#include <vector>

#include "vision/detect/dot_pattern.h"
#include "vision/track/dot_identity.h"

namespace clothfit {

/// Names found dots by the printed pattern, without any tag. Dots are linked to their neighbours on
/// a lattice by the outline's own metric, in which the nearest are those along rows and columns.
/// Every full 3 x 3 neighbourhood is looked up, and all must agree on where, how turned and whether
/// mirrored the lattice lies. Returns false, and places nothing, where fewer than 3 are found or
/// less than nine in ten agree. `layout` is a full grid.
bool name_by_pattern(const DotLayout& layout, const DotPattern& pattern,
                     const DotPatternIndex& index, const std::vector<Dot>& found,
                     PlacedDots& placed);

}  // namespace clothfit
