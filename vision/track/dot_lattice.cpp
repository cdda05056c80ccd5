#include "vision/track/dot_lattice.h"

namespace clothfit {

bool name_by_pattern(const DotLayout&, const DotPattern&, const DotPatternIndex&,
                     const std::vector<Dot>&, PlacedDots&) {
  return false;
}

}  // namespace clothfit
