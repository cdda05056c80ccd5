#pragma once

#include <Eigen/Core>
#include <span>

#include "model/kernels/lanes.h"

namespace clothfit {

/// How what is done to one vertex changes with the place and the velocity of another.
struct MotionBlock {
  int on, of;
  Eigen::Matrix3d by_position, by_velocity;
};

/// How a force T u inside a spring from vertex a to b, u its direction, changes: with L and V the
/// relative position and velocity of its ends, and dT what its tension changes by beyond these, by
///
///   T / l dL + u (w . dL + c u . dV + dT),
///
/// on a, and by as much the other way on b.
struct SpringJacobian {
  int a, b;
  Eigen::Vector3d direction, w_n_per_m;
  double tension_ratio_n_per_m, damping_ns_per_m;  ///< T / l, c
};

/// How what is done to one vertex changes with the force on it.
struct ForceBlock {
  int on;
  Eigen::Matrix3d derivative;
};

// Products of such derivatives with changes in every lane, added to `action`. As in TangentSweep
// they may be fused with sums.

void add_products(std::span<const MotionBlock> blocks, const LaneVectors<>& position_m,
                  const LaneVectors<>& velocity_m_per_s, LaneVectors<>& action);

/// `tension_n`: dT of each spring.
void add_products(std::span<const SpringJacobian> springs, const LaneArray<>& tension_n,
                  const LaneVectors<>& position_m, const LaneVectors<>& velocity_m_per_s,
                  LaneVectors<>& action);

void add_products(std::span<const ForceBlock> blocks, const LaneVectors<>& force_n,
                  LaneVectors<>& action);

}  // namespace clothfit
