#include "fit/problem/mesh_ladder.h"

#include <algorithm>

#include "fit/problem/start_state.h"

namespace clothfit {

int vertices_for_start(int nodes) {
  return (nodes > 0 ? nodes : StartStateOptions::kManyNodes) + 1;
}

std::pair<int, int> other_mesh_of(int columns, int rows, int least) {
  const auto coarser = [](int count) { return (count - 1) / 2 + 1; };
  if (std::min(coarser(columns), coarser(rows)) >= least) return {coarser(columns), coarser(rows)};
  return {2 * columns - 1, 2 * rows - 1};
}

}  // namespace clothfit
