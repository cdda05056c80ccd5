#pragma once

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

#include "model/cloth/cloth.h"
#include "model/rest/held_projection.h"

namespace clothfit {

/// Positions (m) and velocities (m/s) of all vertices, 3 x vertices, world.
struct ImplicitState {
  Eigen::Matrix3Xd position_m;
  Eigen::Matrix3Xd velocity_m_per_s;
  std::vector<EffectMemory<SingleLane>> effect_memory;  ///< empty: nothing remembered yet
};

/// Steps stiff cloth implicitly at steps as long as a frame [baraff1998]:
///
///   (M - h D - h^2 K) dv = h (f + h K v),   V += dv,   P += h V
///
/// with K and D the derivatives of the springs' forces f by position and velocity. In K the
/// negative transverse stiffness of compressed springs is taken for zero, and the change of a
/// dashpot's direction is left out. The matrix is therefore symmetric and positive definite for any
/// h. A matrix that is not exact changes the error but not its order: first, as that of the Euler
/// scheme, with damping of fast motions that grows with h. The held points' velocities are those
/// that bring them to their targets. Effects' forces are taken at the beginning of the step, and
/// the strain limit is left out.
///
/// A sparse Cholesky factorisation solves the system; its symbolic part is kept from step to step.
class ImplicitStepper {
 public:
  /// `cloth` must outlive the stepper. Throws InputError where an effect changes the cloth's
  /// inertia or shifts its supports, which only the explicit scheme can.
  explicit ImplicitStepper(const Cloth& cloth);

  /// Takes one step of `time_step_s` > 0, from `state`, not from the start of `parameters`.
  /// `held_target_m` (3 x held) belongs to its end. False where the numbers did not work out:
  /// `state` is then not finite.
  bool step(const ParameterSet& parameters, const Eigen::Matrix3Xd& held_target_m, double time_s,
            double time_step_s, ImplicitState& state);

 private:
  using Sparse = Eigen::SparseMatrix<double>;

  const Cloth& cloth_;
  HeldProjection held_;
  Sparse motions_;  ///< of the vertices, as held points allow them
  Eigen::SimplicialLLT<Sparse> factors_;
  bool analysed_ = false;
};

}  // namespace clothfit
