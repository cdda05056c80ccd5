#pragma once

#include <utility>

namespace clothfit {

/// No mesh is made coarser than this many vertices a side.
inline constexpr int kSmallestMesh = 7;

/// Columns and rows of the other mesh: half the cells each way where at least `least` vertices are
/// left a side, else twice as many, so that cells keep their proportions.
std::pair<int, int> other_mesh_of(int columns, int rows, int least);

}  // namespace clothfit
