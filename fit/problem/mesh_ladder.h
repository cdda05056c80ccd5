#pragma once

#include <utility>

namespace clothfit {

/// No mesh is made coarser than this many vertices a side.
inline constexpr int kSmallestMesh = 7;

/// Returns how many vertices a side hold the corrections of a start in motion through `nodes` nodes
/// a side (FitOptions::start_nodes).
int vertices_for_start(int nodes);

/// Returns columns and rows of the other mesh, in the same proportions. It has half the cells each
/// way where this leaves at least `least` vertices a side, else twice as many.
std::pair<int, int> other_mesh_of(int columns, int rows, int least);

}  // namespace clothfit
