#pragma once

#include <cstddef>

#include "model/topology/mesh.h"

namespace clothfit {

/// The place where the springs of a type end, from the vertex that they leave to the right or down:
/// from [i, j] to [i + down, j + right]. (Types 0 to 5; of shear_up this is [i+1, j-1] to [i, j]
/// read backwards.)
struct SpringReach {
  int down = 0, right = 0;

  /// Returns how many vertices further on they end, in row-major order; positive.
  std::ptrdiff_t offset(const Mesh& mesh) const {
    return static_cast<std::ptrdiff_t>(down) * mesh.columns + right;
  }
  bool leaves(const Mesh& mesh, int i, int j) const {
    return i + down < mesh.rows && j + right >= 0 && j + right < mesh.columns;
  }
};

inline constexpr SpringReach kSpringReach[kSpringTypes] = {{1, 0},  {0, 1}, {1, 1},
                                                           {1, -1}, {2, 0}, {0, 2}};

/// Rows of scratch memory that the walk in row_sweep-inl.h takes. There are three coordinates of
/// the forces from one row above, and twice three from two rows above, one for the row at hand, one
/// for the next.
inline constexpr int kRowSweepScratchRows = 9;

}  // namespace clothfit
