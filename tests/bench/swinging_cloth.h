#pragma once

#include <cmath>
#include <vector>

#include "model/cloth/cloth.h"

namespace clothfit {

/// Makes the cloth of the bundled recordings, which the benchmarks move. It is 0.4 m x 0.4 m, 25 g,
/// held by its upper corners, waved so that no spring is at rest.
inline Cloth swinging_cloth(int vertices_per_side) {
  const Mesh mesh{
      .columns = vertices_per_side, .rows = vertices_per_side, .width_m = 0.4, .height_m = 0.4};
  Cloth cloth = Cloth::of(mesh, masses_by_area(mesh, 0.025));
  cloth.held = {held_at(mesh, 0, 0), held_at(mesh, 0.4, 0)};
  return cloth;
}

/// Returns `count` sets like cotton, each a thousandth stiffer than the one before.
inline std::vector<ParameterSet> cotton_sets(const Cloth& cloth, int count) {
  std::vector<ParameterSet> sets;
  for (int n = 0; n < count; ++n) {
    const double stiffer = 1 + 0.001 * n;
    const Fabric fabric{.tension_warp_n_per_m = 60 * stiffer,
                        .tension_weft_n_per_m = 45 * stiffer,
                        .shear_n_per_m = 6 * stiffer,
                        .flexion_warp_n_per_m = 2 * stiffer,
                        .flexion_weft_n_per_m = 1.5 * stiffer,
                        .damping_warp_s = 1e-3,
                        .damping_weft_s = 1e-3};
    sets.push_back({.springs = spring_parameters(fabric, cloth.mesh),
                    .start_position_m = flat_positions(cloth.mesh)});
    Eigen::Matrix3Xd& p = sets.back().start_position_m;
    for (Eigen::Index k = 0; k < p.cols(); ++k)
      p(2, k) = 0.02 * std::sin(8 * p(0, k)) * std::cos(7 * p(1, k));
  }
  return sets;
}

}  // namespace clothfit
