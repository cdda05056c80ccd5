#include "model/rest/minimise.h"

#include <cmath>

namespace clothfit {

bool is_over(const StopRule& stop, MinimiseResult& result) {
  const auto over = [&](MinimiseReason reason) {
    result.reason = reason;
    return true;
  };
  if (!std::isfinite(result.energy_j) || !std::isfinite(result.gradient_n))
    return over(MinimiseReason::not_finite);
  if (result.gradient_n <= stop.gradient_n) return over(MinimiseReason::converged);
  if (result.energy_j < stop.lowest_energy_j) return over(MinimiseReason::fell);
  if (result.iterations >= stop.most_iterations) return over(MinimiseReason::iterations_used_up);
  if (stop.go_on && !stop.go_on(result.iterations, result.gradient_n))
    return over(MinimiseReason::cancelled);
  return false;
}

}  // namespace clothfit
