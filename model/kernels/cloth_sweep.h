#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "model/kernels/aligned_numbers.h"
#include "model/kernels/lane_springs.h"
#include "model/kernels/lanes.h"
#include "model/topology/mesh.h"

namespace clothfit {

/// Computes the springs' forces on every vertex in every lane, and the Euler step that they drive.
/// This is the hot loop. Spring and dashpot pull with
///
///   f_a = (k (l - l0) + c dl/dt) u,  f_b = -f_a,  u = (x_b - x_a) / l
///
/// Source: elastic term [louchet1995, section 2.2]; the dashpot is ours. It acts along u only, so
/// cloth that turns rigidly loses no energy. A spring of zero length adds nothing: u is undefined
/// there, and a search that tries poor parameters needs to carry on.
///
/// The mesh is swept once, vertex by vertex, and each pulls its springs to the right and down. The
/// forces on the vertices there are kept until those are reached. A vertex moves as soon as all its
/// forces are known: no spring of a later one reaches back to it. So each number is read and
/// written once per step, and each spring is computed once.
///
/// In `double` the arithmetic is strict IEEE: no contraction, only operations that are rounded
/// correctly (1 / l by Newton's method, to 3e-16), sums in an order that does not depend on the
/// vector length. So the bits are the same on every instruction set. In `float` products may be
/// fused with sums and 1 / l starts from the processor's estimate (4e-7), so they differ between
/// processors. The code is compiled for several instruction sets; the processor's best is taken
/// when the program starts.
///
/// A SingleLane's vectors hold neighbouring vertices of the one simulation; its sums run in the
/// same order, so it has the bits of ExactLanes.
///
/// Holds scratch memory: one object per thread.
template <class L = ExactLanes>
class ClothSweep {
 public:
  explicit ClothSweep(const Mesh& mesh);

  /// Adds the springs' forces (N) to `force_n`. `factors` is null for springs of a type all alike.
  void add_spring_forces(const LaneSprings<L>& springs, const LaneVectors<L>& position_m,
                         const LaneVectors<L>& velocity_m_per_s, LaneVectors<L>& force_n,
                         const SpringFactors<L>* factors = nullptr);

  /// Takes the paper's Euler step, velocities first, positions with the new velocities
  /// [louchet1995, equation 2]:  V += h (g + F / m),  P += h V.  F are the springs' forces and,
  /// where given, `effect_force_n`.
  void step_euler(const LaneSprings<L>& springs, const LaneVector<L>& gravity,
                  const Eigen::VectorXd& inverse_mass_per_kg, const LaneVectors<L>* effect_force_n,
                  double time_step_s, LaneVectors<L>& position_m, LaneVectors<L>& velocity_m_per_s,
                  const SpringFactors<L>* factors = nullptr);

 private:
  Mesh mesh_;
  /// For a single lane: bit k of entry v is set where a spring of the type leaves vertex v + k.
  std::array<std::vector<std::uint8_t>, kSpringTypes> leaving_;
  AlignedNumbers<typename L::Number> scratch_;  ///< forces on vertices that are not reached yet
};

}  // namespace clothfit
