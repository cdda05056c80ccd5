#pragma once

#include <functional>

#include "model/rest/hanging_energy.h"
#include "model/rest/held_projection.h"

namespace clothfit {

enum class MinimiseReason {
  converged,
  iterations_used_up,
  stalled,     ///< no step lowers the energy: rounding, or a spring of no length
  fell,        ///< the energy has no minimum: springs do not carry the cloth
  not_finite,  ///< the start is too far out for the arithmetic
  cancelled
};

/// The rule by which a minimisation ends.
struct StopRule {
  double gradient_n = 0;  ///< 2-norm of the held gradient that counts as equilibrium
  int most_iterations = 0;
  double lowest_energy_j = 0;  ///< a cloth below this has fallen
  /// Called before each iteration with the gradient's norm (N); `false` cancels. May be empty.
  std::function<bool(int iteration, double gradient_n)> go_on;
};

struct MinimiseResult {
  MinimiseReason reason = MinimiseReason::iterations_used_up;
  int iterations = 0;
  int evaluations = 0;  ///< of energy and gradient
  int products = 0;     ///< of the second derivative with a vector
  double energy_j = 0;
  double gradient_n = 0;  ///< 2-norm of the held gradient
};

/// Says whether `result`, at its `iterations`, energy and gradient, ends here; if so, sets its
/// reason.
bool is_over(const StopRule& stop, MinimiseResult& result);

/// The energy as the minimisers see it: held points stay, and evaluations are counted.
class HeldEnergy {
 public:
  /// Both must outlive this.
  HeldEnergy(HangingEnergy& energy, const HeldProjection& held) : energy_(energy), held_(held) {}

  const FieldLayout& layout() const { return energy_.layout(); }
  const HeldProjection& held() const { return held_; }
  HangingEnergy& unheld() { return energy_; }
  int evaluations() const { return evaluations_; }

  /// Returns the energy; `gradient_n` is the residual gradient where held points stay.
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
