#include "model/equilibrium/conjugate_gradient.h"

#include <algorithm>
#include <cmath>

#include "model/equilibrium/line_search.h"

namespace clothfit {

MinimiseResult minimise_by_conjugate_gradients(HeldEnergy& energy, const StopRule& stop,
                                               MeshField& position_m) {
  constexpr double kEnoughSlope = 0.1;
  MinimiseResult result;
  const int evaluations_before = energy.evaluations();
  MeshField gradient(energy.layout()), new_gradient(energy.layout()), trial(energy.layout());
  LinePlace here{.energy_j = energy.energy_and_gradient(position_m, gradient)};
  MeshField direction = gradient;
  direction.values *= -1;
  double gradient2 = dot(gradient, gradient);
  here.slope_n = -gradient2;
  // The stiffest mode of a lattice has about 16 k; a step of its inverse moves safely.
  double stiffest = 1e-12;
  for (const double k : energy.unheld().cloth().stiffness_n_per_m) stiffest = std::max(stiffest, k);
  double step = 1 / (8 * stiffest);

  for (;; ++result.iterations) {
    result.gradient_n = std::sqrt(gradient2);
    result.energy_j = here.energy_j;
    if (!std::isfinite(here.energy_j) || !std::isfinite(gradient2))
      result.reason = MinimiseReason::not_finite;
    else if (result.gradient_n <= stop.gradient_n)
      result.reason = MinimiseReason::converged;
    else if (result.iterations == stop.most_iterations)
      result.reason = MinimiseReason::iterations_used_up;
    else {
      const LinePlace found =
          search_line(energy, position_m, direction, here, step, kEnoughSlope, trial, new_gradient);
      if (found.step == 0 && here.slope_n > -0.99 * gradient2) {
        direction.values = -gradient.values;  // once more, straight down
        here.slope_n = -gradient2;
        continue;
      }
      if (found.step != 0) {
        std::swap(position_m.values, trial.values);
        const double new_gradient2 = dot(new_gradient, new_gradient);
        const double conjugacy =
            std::max(0.0, (new_gradient2 - dot(new_gradient, gradient)) / gradient2);
        std::swap(gradient.values, new_gradient.values);
        gradient2 = new_gradient2;
        direction.values *= conjugacy;
        add_scaled(-1, gradient, direction);
        const double slope_before = here.slope_n;
        here = {.energy_j = found.energy_j, .slope_n = dot(direction, gradient)};
        if (!(here.slope_n < 0)) {
          direction.values = -gradient.values;
          here.slope_n = -gradient2;
        }
        step = found.step * std::clamp(slope_before / here.slope_n, 0.1, 10.0);
        continue;
      }
      result.reason = MinimiseReason::stalled;
    }
    break;
  }
  result.evaluations = energy.evaluations() - evaluations_before;
  return result;
}

}  // namespace clothfit
