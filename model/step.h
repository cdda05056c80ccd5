#pragma once

#include "model/cloth.h"
#include "model/kernels/cloth_sweep.h"
#include "model/lanes.h"

namespace clothfit {

/// The parameter sets of kLanes simulations.
struct LaneParameters {
  LaneSprings<> springs;
  LaneLimits<> limits;  ///< for a cloth with a strain limit
  LaneVector<> gravity_m_per_s2;
  std::vector<std::vector<LaneValue<>>> effects;  ///< [effect][parameter]
};

struct LaneState {
  LaneVectors<> position_m;
  LaneVectors<> velocity_m_per_s;
};

/// Sets one lane's springs, and their limits for a cloth with this strain limit.
void set_lane(int lane, const SpringParameters& springs, const StrainLimit& strain_limit,
              LaneParameters& parameters);

/// Puts held points where they belong.
///
/// The smallest correction in the masses' norm that satisfies all held points at once:
///   P += M^-1 A' (A M^-1 A')^-1 (target - A P),  V += the same / h,
/// with A the interpolation weights. Held points at vertices, the common case, are simply placed.
class HeldPlacement {
 public:
  explicit HeldPlacement(const Cloth& cloth);
  int count() const { return static_cast<int>(held_.size()); }
  /// Vertices with a weight in any held point, rising.
  const std::vector<int>& touched() const { return touched_; }

  /// Where the held points are in the given positions: kLanes x held.
  LaneVectors<> locate(const LaneVectors<>& position_m) const;

  /// Moves the state so that the held points are at `target_m`; `time_step_s` > 0.
  void place(const LaneVectors<>& target_m, double time_step_s, LaneState& state);

 private:
  std::vector<HeldVertexWeights> held_;
  std::vector<int> touched_;
  Eigen::MatrixXd correction_;  ///< touched x held
  LaneArray<> missing_m_;       ///< scratch: one coordinate of what each held point lacks
};

/// Steps kLanes simulations of one cloth through time. Holds scratch memory: one object per thread.
class EulerStepper {
 public:
  /// `cloth` must outlive the stepper.
  explicit EulerStepper(const Cloth& cloth);

  const HeldPlacement& held() const { return held_; }

  /// One time step of the founding paper's scheme [louchet1995, section 2.3], in every lane:
  /// forces at (P, V, t) -> V += h F / m -> P += h V -> held points placed -> springs limited.
  /// `held_target_m` belongs to t + h. Vertices that a held point touches are not moved by the
  /// strain limit.
  void step(const LaneParameters& parameters, const LaneVectors<>& held_target_m, double time_s,
            double time_step_s, LaneState& state);

  /// What the last step's strain limit found.
  const LimitOutcome<>& limit_outcome() const { return limit_outcome_; }

 private:
  const Cloth& cloth_;
  Eigen::VectorXd inverse_mass_per_kg_;
  HeldPlacement held_;
  ClothSweep<> sweep_;
  StrainLimiter<> limiter_;
  LimitOutcome<> limit_outcome_;
  LaneVectors<> effect_force_n_;
};

}  // namespace clothfit
