#pragma once

#include <array>
#include <vector>

#include "model/lanes.h"
#include "model/mesh.h"

namespace clothfit {

/// The springs' constants in every lane.
struct LaneSprings {
  std::array<LaneValue, kSpringTypes> natural_length_m;
  std::array<LaneValue, kSpringTypes> stiffness_n_per_m;
  std::array<LaneValue, kSpringTypes> damping_ns_per_m;
};

/// Adds the pull of every spring and of the dashpot along it to `force_n`:
///
///   f_a = (k (l - l0) + c dl/dt) u,  f_b = -f_a,  u = (x_b - x_a) / l
///
/// Source: elastic term [louchet1995, section 2.2]; the dashpot is ours. It acts along u only, so
/// cloth that turns rigidly loses no energy. A spring of zero length adds nothing: u is undefined
/// there, and a search that tries poor parameters needs to carry on.
///
/// Strict IEEE double (no contraction, no estimates): the same bits on every instruction set.
void add_spring_forces(const SpringNet& springs, const LaneSprings& constants,
                       const LaneVectors& position_m, const LaneVectors& velocity_m_per_s,
                       LaneVectors& force_n);

/// The paper's Euler scheme, velocities first, positions with the new velocities
/// [louchet1995, equation 2]:  V += h F / m,  P += h V.
void integrate_euler(const Eigen::VectorXd& mass_kg, double time_step_s, const LaneVectors& force_n,
                     LaneVectors& velocity_m_per_s, LaneVectors& position_m);

}  // namespace clothfit
