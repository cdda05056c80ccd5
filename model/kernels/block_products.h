#pragma once

#include <Eigen/Core>
#include <span>

#include "model/kernels/lanes.h"

namespace clothfit {

/// The change of an action on one vertex with the place and the velocity of another.
struct MotionBlock {
  int on, of;
  Eigen::Matrix3d by_position, by_velocity;
};

/// The change of a force T u inside a spring from vertex a to b, u its direction. With L and V the
/// relative position and velocity of its ends, and dT the change of its tension beyond these, it is
///
///   T / l dL + u (w . dL + c u . dV + dT),
///
/// on a, and the opposite on b.
struct SpringJacobian {
  int a, b;
  Eigen::Vector3d direction, w_n_per_m;
  double tension_ratio_n_per_m, damping_ns_per_m;  ///< T / l, c
};

/// The change of an action on one vertex with the force on it.
struct ForceBlock {
  int on;
  Eigen::Matrix3d derivative;
};

// These functions add products of such derivatives with changes in every lane to `action`. As in
// TangentSweep no product is fused with a sum.

template <class L>
void add_products(std::span<const MotionBlock> blocks, const LaneVectors<L>& position_m,
                  const LaneVectors<L>& velocity_m_per_s, LaneVectors<L>& action);

/// `tension_n` holds dT of each spring.
template <class L>
void add_products(std::span<const SpringJacobian> springs, const LaneArray<L>& tension_n,
                  const LaneVectors<L>& position_m, const LaneVectors<L>& velocity_m_per_s,
                  LaneVectors<L>& action);

template <class L>
void add_products(std::span<const ForceBlock> blocks, const LaneVectors<L>& force_n,
                  LaneVectors<L>& action);

}  // namespace clothfit
