#include "model/rest/conjugate_gradient.h"

#include <algorithm>
#include <cmath>

#include "model/rest/line_search.h"

namespace clothfit {

MinimiseResult minimise_by_conjugate_gradients(HeldEnergy& energy, const StopRule& stop,
                                               MeshField& position_m) {
  constexpr double kEnoughSlope = 0.1;
  const int evaluations_before = energy.evaluations();
  MeshField gradient(energy.layout()), new_gradient(energy.layout()), trial(energy.layout());
  MeshField direction(energy.layout());
  LinePlace here{.energy_j = energy.energy_and_gradient(position_m, gradient)};
  double gradient2 = dot(gradient, gradient);
  const auto go_straight_down = [&] {
    direction.values = -gradient.values;
    here.slope_n = -gradient2;
  };
  go_straight_down();
  // No mode of a lattice is stiffer than about 16 k.
  const double stiffest = std::ranges::max(energy.unheld().cloth().stiffness_n_per_m);
  double step = 1 / (8 * stiffest);

  MinimiseResult result{.energy_j = here.energy_j, .gradient_n = std::sqrt(gradient2)};
  while (!is_over(stop, result)) {
    const LinePlace found =
        search_line(energy, position_m, direction, here, step, kEnoughSlope, trial, new_gradient);
    if (found.step == 0) {
      if (here.slope_n == -gradient2) {
        result.reason = MinimiseReason::stalled;
        break;
      }
      go_straight_down();
      continue;
    }
    ++result.iterations;
    std::swap(position_m.values, trial.values);
    std::swap(gradient.values, new_gradient.values);
    const double slope_before = here.slope_n;
    const double new_gradient2 = dot(gradient, gradient);
    const double conjugacy =
        std::max(0.0, (new_gradient2 - dot(gradient, new_gradient)) / gradient2);
    gradient2 = new_gradient2;
    direction.values *= conjugacy;
    add_scaled(-1, gradient, direction);
    here = {.energy_j = found.energy_j, .slope_n = dot(direction, gradient)};
    if (!(here.slope_n < 0)) go_straight_down();
    // The first trial step aims at the change of energy of the step before.
    step = found.step * std::clamp(slope_before / here.slope_n, 0.1, 10.0);
    result.energy_j = here.energy_j;
    result.gradient_n = std::sqrt(gradient2);
  }
  result.evaluations = energy.evaluations() - evaluations_before;
  return result;
}

}  // namespace clothfit
