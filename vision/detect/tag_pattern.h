#pragma once

#include <vector>

namespace clothfit {

/// A tag as it is printed, in square cells. Tag coordinates (x, y) are those of AprilTag's
/// homography: the border spans [-1, 1], x to the right and y down on the upright tag.
struct TagPattern {
  int border_cells = 0;      ///< across the border
  int total_cells = 0;       ///< across everything printed; total_cells^2 entries in `white`
  std::vector<float> white;  ///< 1 white, 0 black; row by row from the top left

  double cell() const { return 2.0 / border_cells; }
};

}  // namespace clothfit
