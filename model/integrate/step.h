#pragma once

#include <span>
#include <vector>

#include "model/cloth/cloth.h"
#include "model/kernels/cloth_sweep.h"
#include "model/kernels/lanes.h"

namespace clothfit {

/// The parameter sets of the simulations in all lanes.
template <class L = ExactLanes>
struct LaneParameters {
  LaneSprings<L> springs;
  LaneLimits<L> limits;  ///< for a cloth with a strain limit
  LaneVector<L> gravity_m_per_s2;
  std::vector<EffectValues<L>> effects;
};

template <class L = ExactLanes>
struct LaneState {
  LaneVectors<L> position_m;
  LaneVectors<L> velocity_m_per_s;
  std::vector<EffectMemory<L>> effect_memory;  ///< of each effect of the cloth

  /// Makes a state at rest, with nothing remembered; the caller sets the positions.
  static LaneState of(const Cloth& cloth);
};

/// Lets one lane start as `set` does.
template <class L>
void set_start(int lane, const ParameterSet& set, LaneState<L>& state);

/// Sets one lane's springs, and their limits for a cloth with this strain limit.
template <class L>
void set_lane(int lane, const SpringParameters& springs, const StrainLimit& strain_limit,
              LaneParameters<L>& parameters);

/// Collects the parameters of as many sets as there are lanes. A missing set repeats the last one,
/// so that every lane computes something finite.
template <class L>
LaneParameters<L> lane_parameters(const Cloth& cloth, std::span<const ParameterSet> sets);

/// Puts held points where they belong.
///
/// The correction is the smallest in the masses' norm that satisfies all held points at once:
///   P += M^-1 A' (A M^-1 A')^-1 (target - A P),  V += the same / h,
/// with A the interpolation weights. Held points at vertices, the common case, are simply placed.
template <class L = ExactLanes>
class HeldPlacement {
 public:
  explicit HeldPlacement(const Cloth& cloth);
  int count() const { return static_cast<int>(held_.size()); }
  /// Returns the vertices with a weight in any held point, rising.
  const std::vector<int>& touched() const { return touched_; }

  /// Returns where the held points are in the given positions.
  LaneVectors<L> locate(const LaneVectors<L>& position_m) const;

  /// Moves the state so that the held points are at `target_m`; `time_step_s` > 0.
  void place(const LaneVectors<L>& target_m, double time_step_s, LaneVectors<L>& position_m,
             LaneVectors<L>& velocity_m_per_s);

  /// Adds the cloth's pull on each held point: its share of each vertex's force and weight.
  void add_pulls(const LaneVectors<L>& force_n, const LaneVector<L>& gravity_m_per_s2,
                 LaneVectors<L>& pull_n) const;

  /// Returns the matrix from a correction of each held point to the vertices' shifts in `place`.
  const Eigen::MatrixXd& correction() const { return correction_; }
  const std::vector<HeldVertexWeights>& points() const { return held_; }

 private:
  std::vector<HeldVertexWeights> held_;
  std::vector<int> touched_;
  Eigen::VectorXd mass_kg_;
  Eigen::MatrixXd correction_;  ///< touched x held
  LaneArray<L> missing_m_;  ///< scratch: one coordinate of each held point's distance to its target
};

/// Returns inverse masses, 0 at the vertices that a held point touches: the strain limit must not
/// move them.
Eigen::VectorXd movable_inverse_mass(const Cloth& cloth, const std::vector<int>& touched);

/// Advances velocities and positions from forces known in full: V += h (g + F / m), P += h V.
template <class L>
void move_by_forces(const LaneVectors<L>& force_n, const LaneVector<L>& gravity_m_per_s2,
                    const Eigen::VectorXd& inverse_mass_per_kg, double time_step_s,
                    LaneVectors<L>& position_m, LaneVectors<L>& velocity_m_per_s);

/// Further inputs and outputs of a step; each may be null.
template <class L = ExactLanes>
struct StepExtras {
  const SpringFactors<L>* factors = nullptr;
  const LaneVectors<L>* force_n = nullptr;  ///< on every vertex, beside all others
  std::vector<LimitMove>* moves = nullptr;  ///< a single simulation's strain limit adds its moves
  /// Set to the velocities that forces have made, before held points are placed.
  LaneVectors<L>* driven_velocity_m_per_s = nullptr;
};

/// Steps the simulations in all lanes through time. Holds scratch memory: one object per thread.
template <class L = ExactLanes>
class EulerStepper {
 public:
  /// `cloth` must outlive the stepper.
  explicit EulerStepper(const Cloth& cloth);

  const HeldPlacement<L>& held() const { return held_; }

  /// Takes one time step of the founding paper's scheme [louchet1995, section 2.3], in every lane:
  /// forces at (P, V, t) -> V += h F / m -> P += h V -> held points placed -> springs limited.
  /// `held_target_m` belongs to t + h. The strain limit does not move vertices that a held point
  /// touches.
  void step(const LaneParameters<L>& parameters, const LaneVectors<L>& held_target_m, double time_s,
            double time_step_s, LaneState<L>& state, const StepExtras<L>& extras = {});

  /// Returns what the last step's strain limit found.
  const LimitOutcome<L>& limit_outcome() const { return limit_outcome_; }

 private:
  const Cloth& cloth_;
  Eigen::VectorXd inverse_mass_per_kg_;
  bool changes_force_ = false, shifts_supports_ = false;  ///< any effect
  HeldPlacement<L> held_;
  ClothSweep<L> sweep_;
  StrainLimiter<L> limiter_;
  LimitOutcome<L> limit_outcome_;
  LaneVectors<L> force_n_, pull_n_, target_m_;
};

}  // namespace clothfit
