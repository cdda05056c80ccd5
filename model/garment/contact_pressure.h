#pragma once

#include <algorithm>
#include <cmath>

namespace clothfit {

/// What presses surfaces apart that are nearer than a distance delta, per area: from nothing at
/// delta over a few pascals of cloth that lies on a shoulder to more than any garment's at d = 0,
///
///   p = p0 (exp(u) - 1 - u),   u = 12 (1 - d / delta) for d < delta,   p0 = 1 Pa.
///
/// So no stiffness has to be guessed. Below d = 0 it goes on along its tangent.
struct ContactPressure {
  double energy_j_per_m2 = 0, pressure_pa = 0, stiffness_n_per_m3 = 0;
};

inline ContactPressure contact_pressure(double distance_m, double delta_m) {
  constexpr double kPressure_pa = 1, kSteepness = 12;
  const double u = kSteepness * (1 - distance_m / delta_m);
  if (u <= 0) return {};
  const double beneath = std::max(u - kSteepness, 0.0), v = u - beneath;
  const double grown = std::exp(v), length_m = delta_m / kSteepness;
  const double pressure = grown - 1 - v, rise = grown - 1;
  return {.energy_j_per_m2 =
              kPressure_pa * length_m *
              (grown - 1 - v - 0.5 * v * v + pressure * beneath + 0.5 * rise * beneath * beneath),
          .pressure_pa = kPressure_pa * (pressure + rise * beneath),
          .stiffness_n_per_m3 = kPressure_pa * rise / length_m};
}

}  // namespace clothfit
