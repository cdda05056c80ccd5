#pragma once

#include <string>

#include "model/fabric/fabric.h"

namespace clothfit {

/// The gravity of laboratories, as in docs/conventions.md.
inline constexpr double kGravity_m_per_s2 = 9.81;

/// A fabric as laboratories measure it, per width of cloth; warp along t, weft along s.
struct MeasuredFabric {
  double areal_density_kg_per_m2 = 0;
  /// Tension per width and strain of a strip whose width is kept (N/m).
  double tension_warp_n_per_m = 0, tension_weft_n_per_m = 0;
  /// Shear force per width and radian (N/m).
  double shear_n_per_m = 0;
  /// Moment per width and curvature of a thread direction (N m).
  double bending_warp_n_m = 0, bending_weft_n_m = 0;

  /// Throws InputError for numbers that are none or below what a fabric has. Names of members
  /// stand in the messages.
  void validate() const;

  /// Returns (B / (density g))^(1/3), the bending length of a thread direction (m) [astm.d1388].
  double bending_length_warp_m() const;
  double bending_length_weft_m() const;
};

/// A measured fabric as fibres: every direction resists by itself the stretch of cloth along it.
/// Four directions have the measured stiffness; their lateral contraction follows.
struct FabricFibres {
  double warp_n_per_m = 0, weft_n_per_m = 0;  ///< tension per width and strain, >= 0
  double bias_n_per_m = 0;                    ///< the same, of each of the two diagonals
};

/// The fibres of a fabric and what they get wrong. With fibres in four directions the stiffness
/// tensor has Cauchy's symmetry: a strip that is kept from contracting pulls sideways with C12 =
/// C33 = shear_n_per_m, whatever it does in truth.
struct FibreConversion {
  FabricFibres fibres;
  /// The share by which a strip that contracts freely is softer than one that does not, 1 - E / C,
  /// E = C11 - C12^2 / C22: what a tension test with free edges would disagree by. > 0, often 1e-3.
  double free_strip_softer_warp = 0, free_strip_softer_weft = 0;
};

/// Throws InputError where a direction is softer in tension than in shear: fibres cannot push that
/// much, and the numbers hint at mixed units.
FibreConversion fibres_of(const MeasuredFabric& fabric);

/// The springs of a square lattice, and the stiffness of the effect `bending_energy`, that stand
/// for a measured fabric in simulation; and what they get wrong.
struct SpringConversion {
  Fabric fabric;           ///< without damping
  double bending_n_m = 0;  ///< geometric mean of warp and weft: the effect knows one
  double bending_warp_off = 0, bending_weft_off = 0;  ///< shares by which the mean is off
  FibreConversion fibres;
};
SpringConversion measured_springs(const MeasuredFabric& fabric);

}  // namespace clothfit
