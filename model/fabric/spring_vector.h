#pragma once

#include <Eigen/Core>
#include <array>
#include <string>

#include "model/fabric/fabric.h"

namespace clothfit {

/// The numbers of SpringParameters in one order, for derivatives. Natural lengths (m) of types 0 to
/// 5 come first, then stiffnesses (N/m), dampings (N s/m) and critical elongations.
inline constexpr int kSpringNumbers = 4 * kSpringTypes;
using SpringVector = Eigen::Matrix<double, kSpringNumbers, 1>;
enum SpringBlock : int {
  natural_length_block = 0,
  stiffness_block = kSpringTypes,
  damping_block = 2 * kSpringTypes,
  elongation_block = 3 * kSpringTypes
};

SpringVector to_vector(const SpringParameters& springs);
SpringParameters springs_of(const SpringVector& numbers);

/// The parameter set nearest to given springs.
template <class Set>
struct Nearest {
  Set set;
  /// Root mean squares, over the six types, of the differences of the set's springs from those
  /// given. Zero where they are the same, a limit that both lack included.
  double natural_length_m = 0;
  double stiffness_n_per_m = 0;
  double damping_ns_per_m = 0;
  double critical_elongation = 0;
  /// Says why there is no such set; empty when there is one.
  std::string reason;

  bool usable() const { return reason.empty(); }
};

/// Returns the root mean square of differences over the types; equal infinities differ by nothing.
double rms_difference(const std::array<double, kSpringTypes>& a,
                      const std::array<double, kSpringTypes>& b);

/// Fills the differences of `nearest` from `given` and the set's own springs.
template <class Set>
void measure_differences(const SpringParameters& given, const SpringParameters& own,
                         Nearest<Set>& nearest) {
  nearest.natural_length_m = rms_difference(given.natural_length_m, own.natural_length_m);
  nearest.stiffness_n_per_m = rms_difference(given.stiffness_n_per_m, own.stiffness_n_per_m);
  nearest.damping_ns_per_m = rms_difference(given.damping_ns_per_m, own.damping_ns_per_m);
  nearest.critical_elongation = rms_difference(given.critical_elongation, own.critical_elongation);
}

/// Throws InputError at `where` unless every number is possible for a spring. Natural lengths are
/// above 0; stiffness, damping and critical elongation are 0 or more (the last may be infinite: no
/// limit); at least one stiffness is above 0.
void require_possible(const SpringParameters& springs, const std::string& where);

}  // namespace clothfit
