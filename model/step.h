#pragma once

#include "model/cloth.h"
#include "model/kernels/spring_force.h"
#include "model/lanes.h"

namespace clothfit {

/// The parameter sets of kLanes simulations.
struct LaneParameters {
  LaneSprings springs;
  LaneValue gravity_x, gravity_y, gravity_z;
  std::vector<std::vector<LaneValue>> effects;  ///< [effect][parameter]
};

struct LaneState {
  LaneVectors position_m;
  LaneVectors velocity_m_per_s;
};

/// Puts held points where they belong.
///
/// The smallest correction in the masses' norm that satisfies all held points at once:
///   P += M^-1 A' (A M^-1 A')^-1 (target - A P),  V += the same / h,
/// with A the interpolation weights. Held points at vertices, the common case, are simply placed.
class HeldPlacement {
 public:
  explicit HeldPlacement(const Cloth& cloth);
  int count() const { return static_cast<int>(held_.size()); }

  /// Where the held points are in the given positions: kLanes x held.
  LaneVectors locate(const LaneVectors& position_m) const;

  /// Moves the state so that the held points are at `target_m`; `time_step_s` > 0.
  void place(const LaneVectors& target_m, double time_step_s, LaneState& state) const;

 private:
  std::vector<HeldVertexWeights> held_;
  std::vector<int> touched_;    ///< vertices with a weight in any held point
  Eigen::MatrixXd correction_;  ///< touched x held
};

/// One time step of the founding paper's scheme [louchet1995, section 2.3], in every lane:
/// forces at (P, V, t) -> V += h F / m -> P += h V -> held points placed.
/// `force_n` is scratch of the same shape as the positions; `held_target_m` belongs to t + h.
void step(const Cloth& cloth, const LaneParameters& parameters, const HeldPlacement& held,
          const LaneVectors& held_target_m, double time_s, double time_step_s, LaneState& state,
          LaneVectors& force_n);

}  // namespace clothfit
