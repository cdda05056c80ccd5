#pragma once

#include <array>
#include <limits>

#include "model/topology/mesh.h"

namespace clothfit {

/// The constants of the six spring types; every spring of a type is alike.
struct SpringParameters {
  std::array<double, kSpringTypes> natural_length_m{};   ///< > 0
  std::array<double, kSpringTypes> stiffness_n_per_m{};  ///< >= 0
  std::array<double, kSpringTypes> damping_ns_per_m{};   ///< >= 0; along the spring
  /// Elongation that a strain limit allows, as a share of the natural length.
  std::array<double, kSpringTypes> critical_elongation = kNoLimit;

  static constexpr double kInfinite = std::numeric_limits<double>::infinity();
  static constexpr std::array<double, kSpringTypes> kNoLimit{kInfinite, kInfinite, kInfinite,
                                                             kInfinite, kInfinite, kInfinite};
};

/// The parameter set `fabric`, as a person describes a cloth: warp along t, weft along s.
///
/// Stiffness values are the springs' own (N/m). A square lattice of them amounts to a continuum
/// with C11 = k01 + k23 + 4 k45 and C12 = C33 = k23 (N/m) away from its edges, whatever its
/// spacing. Damping is a retardation time: each spring of stiffness k carries a dashpot k * damping
/// beside it (a Kelvin-Voigt solid). So the damping is the fabric's too, and not the mesh's. Shear
/// springs, which run between warp and weft, use the mean of the two times.
struct Fabric {
  double tension_warp_n_per_m = 0;  ///< type 0
  double tension_weft_n_per_m = 0;  ///< type 1
  double shear_n_per_m = 0;         ///< types 2 and 3
  double flexion_warp_n_per_m = 0;  ///< type 4
  double flexion_weft_n_per_m = 0;  ///< type 5
  double damping_warp_s = 0;
  double damping_weft_s = 0;
};

/// Returns the springs of a mesh of this fabric, all at rest in the flat cloth.
SpringParameters spring_parameters(const Fabric& fabric, const Mesh& mesh);

}  // namespace clothfit
