#include "model/equilibrium/conjugate_gradient.h"

#include <algorithm>
#include <cmath>

namespace clothfit {
namespace {

/// A place on the line that is searched.
struct Place {
  double step = 0;
  double energy_j = 0;
  double slope_n = 0;
};

/// Searches along `direction` from `at`, whose energy and slope `start` has; leaves the place found
/// in `position_m` and `gradient_n`. Returns a step of zero where nothing lower was found.
Place search_line(HeldEnergy& energy, const MeshField& at, const MeshField& direction,
                  const Place& start, double first_step, MeshField& position_m,
                  MeshField& gradient_n) {
  constexpr double kEnoughSlope = 0.1;
  constexpr int kMostTrials = 30;
  const double rounding_j = 1e-13 * std::abs(start.energy_j) + 1e-300;
  Place low = start, high;  // the minimum lies between once `bounded`
  bool bounded = false;
  double step = first_step;
  for (int trial = 0; trial < kMostTrials; ++trial) {
    position_m.values = at.values;
    add_scaled(step, direction, position_m);
    Place here{.step = step};
    here.energy_j = energy.energy_and_gradient(position_m, gradient_n);
    here.slope_n = dot(gradient_n, direction);
    const bool higher = !(here.energy_j <= start.energy_j + rounding_j);
    if (!higher && std::abs(here.slope_n) <= kEnoughSlope * std::abs(start.slope_n)) return here;
    if (higher || here.slope_n > 0) {
      high = here;
      bounded = true;
    } else {
      low = here;
    }
    // Where the slope vanishes if it falls evenly, inside the bounds.
    if (bounded) {
      const double rise = high.slope_n - low.slope_n;
      const double secant = rise > 0 ? low.step - low.slope_n * (high.step - low.step) / rise : NAN;
      const double width = high.step - low.step;
      step = std::isfinite(secant)
                 ? std::clamp(secant, low.step + 0.05 * width, high.step - 0.05 * width)
                 : low.step + 0.1 * width;
    } else {
      const double fall = here.slope_n - start.slope_n;
      const double secant = fall > 0 ? here.step - here.slope_n * here.step / fall : 4 * here.step;
      step = std::clamp(secant, 1.2 * here.step, 4 * here.step);
    }
  }
  if (low.step == 0) return {};
  position_m.values = at.values;
  add_scaled(low.step, direction, position_m);
  low.energy_j = energy.energy_and_gradient(position_m, gradient_n);
  return low;
}

}  // namespace

MinimiseResult minimise_by_conjugate_gradients(HeldEnergy& energy, const StopRule& stop,
                                               MeshField& position_m) {
  MinimiseResult result;
  const int evaluations_before = energy.evaluations();
  MeshField gradient(energy.layout()), new_gradient(energy.layout()), trial(energy.layout());
  Place here{.energy_j = energy.energy_and_gradient(position_m, gradient)};
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
      const Place found =
          search_line(energy, position_m, direction, here, step, trial, new_gradient);
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
