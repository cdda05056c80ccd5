#pragma once

#include <functional>

#include "model/equilibrium/hanging_energy.h"
#include "model/equilibrium/held_projection.h"

namespace clothfit {

/// When a minimisation ends.
struct StopRule {
  double gradient_n = 0;  ///< 2-norm of the projected gradient that counts as equilibrium
  int most_iterations = 0;
};

enum class MinimiseReason {
  converged,
  iterations_used_up,
  stalled,  ///< no step that lowers the energy was found: rounding, or a spring of no length
  not_finite
};

struct MinimiseResult {
  MinimiseReason reason = MinimiseReason::iterations_used_up;
  int iterations = 0;
  int evaluations = 0;  ///< of energy and gradient
  int products = 0;     ///< of the second derivative with a vector
  double energy_j = 0;
  double gradient_n = 0;  ///< 2-norm of the projected gradient
};

/// The energy as the minimisers see it: held points are held, and evaluations are counted.
class HeldEnergy {
 public:
  HeldEnergy(HangingEnergy& energy, const HeldProjection& held) : energy_(energy), held_(held) {}
  const FieldLayout& layout() const { return energy_.layout(); }
  const HeldProjection& held() const { return held_; }
  HangingEnergy& unheld() { return energy_; }
  int evaluations() const { return evaluations_; }

  /// `gradient_n` is what is left of it where held points stay.
  double energy_and_gradient(const MeshField& position_m, MeshField& gradient_n) {
    ++evaluations_;
    const double energy_j = energy_.energy_and_gradient(position_m, gradient_n);
    held_.project(gradient_n);
    return energy_j;
  }

 private:
  HangingEnergy& energy_;
  const HeldProjection& held_;
  int evaluations_ = 0;
};

}  // namespace clothfit
