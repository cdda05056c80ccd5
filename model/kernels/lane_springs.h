#pragma once

#include <array>

#include "model/kernels/lanes.h"
#include "model/topology/mesh.h"

namespace clothfit {

/// The springs' constants in every lane.
template <class L = ExactLanes>
struct LaneSprings {
  std::array<LaneValue<L>, kSpringTypes> natural_length_m;
  std::array<LaneValue<L>, kSpringTypes> stiffness_n_per_m;
  std::array<LaneValue<L>, kSpringTypes> damping_ns_per_m;
};

/// Factors on the constants of single springs, the same in every lane. They are by type and by the
/// vertex that a spring leaves to the right or down (of shear_up: [i, j], which it leaves for [i+1,
/// j-1]). Where no spring leaves, the number counts for nothing.
template <class L = ExactLanes>
struct SpringFactors {
  using PerVertex = Eigen::Array<typename L::Number, Eigen::Dynamic, 1>;
  std::array<PerVertex, kSpringTypes> stiffness;
  std::array<PerVertex, kSpringTypes> natural_length;

  /// Entries beyond the last one that vectors over vertices may read: make factors by `ones`.
  static constexpr int kPadding = 8;

  static SpringFactors ones(const Mesh& mesh) {
    SpringFactors factors;
    factors.stiffness.fill(PerVertex::Ones(mesh.vertex_count() + kPadding));
    factors.natural_length = factors.stiffness;
    return factors;
  }
};

}  // namespace clothfit
