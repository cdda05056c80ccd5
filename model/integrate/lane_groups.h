#pragma once

#include <algorithm>
#include <span>
#include <type_traits>

#include "data/parallel.h"
#include "model/cloth/cloth.h"
#include "model/kernels/lanes.h"

namespace clothfit {

/// Calls `run.operator()<L>(group, first)` for every group of parameter sets, in parallel. A group
/// has as many as lanes of a kind hold; a few left over run one by one.
template <class L, class Run>
void for_lane_groups(std::span<const ParameterSet> parameters, const Run& run) {
  const size_t whole = parameters.size() / L::kCount, left = parameters.size() % L::kCount;
  // All lanes cost about as much as this many simulations vectorised over the cloth.
  constexpr size_t kWorthAGroup = std::is_same_v<L, FastLanes> ? 3 : 5;
  const size_t groups = whole + (left > kWorthAGroup ? 1 : 0);
  const size_t in_groups = std::min(groups * L::kCount, parameters.size());
  for_each_index(groups + parameters.size() - in_groups, [&](size_t g) {
    if (g < groups) {
      const size_t first = g * L::kCount;
      run.template operator()<L>(
          parameters.subspan(first, std::min<size_t>(L::kCount, in_groups - first)), first);
    } else {
      const size_t first = in_groups + g - groups;
      run.template operator()<SingleLane>(parameters.subspan(first, 1), first);
    }
  });
}

}  // namespace clothfit
