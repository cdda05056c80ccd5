#pragma once

#include <array>
#include <vector>

#include "model/kernels/aligned_numbers.h"
#include "model/kernels/cloth_sweep.h"
#include "model/kernels/lanes.h"
#include "model/topology/mesh.h"

namespace clothfit {

/// Gives products with the derivative of the springs' forces in a state of one simulation, and with
/// its transpose.
///
/// With L and V the relative position and velocity of a spring's ends, l = |L|, u = L / l, and the
/// tension T = k (l - l0) + c u . V, the force T u changes by
///
///   dF = T / l dL + u (w . dL + c u . dV + (l - l0) dk - k dl0 + (u . V) dc),
///   w = (k - T / l) u + c / l (V - u (u . V)).
///
/// Directions lie in exact or in fast lanes; the state is in double precision.
///
/// No product is fused with a sum, so that every instruction set gives the same bits. Where a fit
/// ends depends on them.
///
/// Holds scratch memory: one object per thread.
class TangentSweep {
 public:
  explicit TangentSweep(const Mesh& mesh);

  /// The state at which derivatives are taken. `factors` is null for springs of a type all alike.
  struct State {
    const LaneSprings<SingleLane>& springs;
    const LaneVectors<SingleLane>& position_m;
    const LaneVectors<SingleLane>& velocity_m_per_s;
    const SpringFactors<SingleLane>* factors = nullptr;
  };

  /// Computes the derivative of ClothSweep::step_euler along a direction in every lane. State and
  /// parameters change by `position_m`, `velocity_m_per_s`, `springs` (derivatives of the types'
  /// constants) and `gravity`, the forces of effects by `effect_force_n` (may be null).
  template <class L>
  void step_euler(const State& at, const LaneSprings<L>& springs, const LaneVector<L>& gravity,
                  const Eigen::VectorXd& inverse_mass_per_kg, const LaneVectors<L>* effect_force_n,
                  double time_step_s, LaneVectors<L>& position_m, LaneVectors<L>& velocity_m_per_s);

  /// Computes the derivative of ClothSweep::add_spring_forces, likewise.
  template <class L>
  void add_spring_forces(const State& at, const LaneSprings<L>& springs,
                         const LaneVectors<L>& position_m, const LaneVectors<L>& velocity_m_per_s,
                         LaneVectors<L>& force_n);

  /// A number for every spring, by type and by the vertex it leaves.
  using PerSpring = std::array<std::vector<double>, kSpringTypes>;

  /// A cost's derivatives by every single spring's constants.
  struct SpringGradients {
    PerSpring natural_length_m, stiffness_n_per_m, damping_ns_per_m;

    static SpringGradients zero(const Mesh& mesh);
  };

  /// Multiplies by the transpose. From a cost's derivatives by the forces, it adds those by the
  /// state before to `by_position` and `by_velocity`, and those by the springs' own constants to
  /// `by_springs`.
  void add_transposed(const State& at, const LaneVectors<SingleLane>& by_force,
                      LaneVectors<SingleLane>& by_position, LaneVectors<SingleLane>& by_velocity,
                      SpringGradients& by_springs);

  /// Multiplies by the transpose of one coordinate of V += h (g + F / m), P += h V. It starts from
  /// a cost's derivatives by the new positions and velocities. It turns `by_velocity` into those by
  /// V before, sets `by_force`, and adds to `by_mass` those by the masses, from the acceleration
  /// that `driven` velocities show.
  static void take_back_motion(double time_step_s, double gravity_m_per_s2,
                               const Eigen::VectorXd& inverse_mass_per_kg,
                               const LaneArray<SingleLane>& velocity_m_per_s,
                               const LaneArray<SingleLane>& driven_velocity_m_per_s,
                               const LaneArray<SingleLane>& by_position,
                               LaneArray<SingleLane>& by_velocity, LaneArray<SingleLane>& by_force,
                               Eigen::VectorXd& by_mass);

 private:
  Mesh mesh_;
  std::array<AlignedNumbers<double>, kSpringTypes> exists_;  ///< 1 where a spring leaves a vertex
  AlignedNumbers<double> scratch_;
  AlignedNumbers<float> fast_scratch_;
};

}  // namespace clothfit
