#include "model/rest/line_search.h"

#include <algorithm>
#include <cmath>

namespace clothfit {

LinePlace search_line(HeldEnergy& energy, const MeshField& at, const MeshField& direction,
                      const LinePlace& start, double first_step, double enough_slope,
                      MeshField& position_m, MeshField& gradient_n) {
  constexpr int kMostTrials = 30;
  const double rounding_j = 1e-13 * std::abs(start.energy_j) + 1e-300;
  LinePlace low = start, high;  // the minimum lies between once `bounded`
  bool bounded = false;
  double step = first_step;
  for (int trial = 0; trial < kMostTrials; ++trial) {
    position_m.values = at.values;
    add_scaled(step, direction, position_m);
    LinePlace here{.step = step};
    here.energy_j = energy.energy_and_gradient(position_m, gradient_n);
    here.slope_n = dot(gradient_n, direction);
    const bool higher = !(here.energy_j <= start.energy_j + rounding_j);
    if (!higher && std::abs(here.slope_n) <= enough_slope * std::abs(start.slope_n)) return here;
    if (higher || here.slope_n > 0) {
      high = here;
      bounded = true;
    } else {
      low = here;
    }
    // The next step is where the slope vanishes if it falls evenly, inside the bounds.
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

}  // namespace clothfit
