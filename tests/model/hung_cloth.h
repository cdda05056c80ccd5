#pragma once

#include <vector>

#include "tests/model/random_cloth.h"

namespace clothfit {

/// Makes a cloth held by its two upper corners.
inline Cloth hung_cloth(int vertices_per_side) {
  Cloth cloth = square_cloth(vertices_per_side);
  cloth.held = {held_at(cloth.mesh, 0, 0), held_at(cloth.mesh, 0.4, 0)};
  return cloth;
}

/// Returns random fabrics and crumpled starts, with one effect of one parameter.
inline std::vector<ParameterSet> random_sets(const Cloth& cloth, int count, unsigned seed) {
  Uniform uniform(seed);
  std::vector<ParameterSet> sets;
  for (int n = 0; n < count; ++n) {
    sets.push_back({.springs = spring_parameters(random_fabric(uniform), cloth.mesh),
                    .effects = {{uniform(0, 2)}},
                    .start_position_m = crumpled(cloth.mesh, 0.1, uniform)});
  }
  return sets;
}

}  // namespace clothfit
