#include "model/cloth/stability.h"

#include <array>
#include <cmath>

#include "model/cloth/network_bound.h"

namespace clothfit {
double stable_time_step_s(const Cloth& cloth, const ParameterSet& parameters) {
  const auto bound = [&](const std::array<double, kSpringTypes>& constant) {
    return network_bound(
        cloth, [&](SpringType type, const Spring&) { return constant[static_cast<size_t>(type)]; });
  };
  double omega2 = bound(parameters.springs.stiffness_n_per_m);
  double gamma = bound(parameters.springs.damping_ns_per_m);
  double acceleration_ratio = 1;
  for (size_t e = 0; e < cloth.effects.size(); ++e) {
    const EffectRates rates =
        cloth.effects[e]->rates(cloth, parameters.springs, parameters.effects[e]);
    omega2 += rates.frequency2_per_s2;
    gamma += rates.damping_per_s;
    acceleration_ratio *= rates.acceleration_ratio;
  }
  omega2 *= acceleration_ratio;
  gamma *= acceleration_ratio;
  // h^2 omega2 + 2 h gamma - 4 = 0, in the form that survives omega2 = 0.
  const double root = std::sqrt(gamma * gamma + 4 * omega2);
  return gamma + root > 0 ? 4 / (gamma + root) : INFINITY;
}

}  // namespace clothfit
