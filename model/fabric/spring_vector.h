#pragma once

#include <Eigen/Core>
#include <array>
#include <string>

#include "model/fabric/fabric.h"

namespace clothfit {

/// The numbers of SpringParameters in one order, for derivatives: natural lengths (m) of types 0 to
/// 5, then stiffnesses (N/m), dampings (N s/m) and critical elongations.
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

/// A parameter set that says as nearly the same as given springs as it can.
template <class Set>
struct Nearest {
  Set set;
  /// Root mean squares over the six types of what the set's own springs differ by from those given.
  /// Zero where they are the same, a limit that both lack included.
  double natural_length_m = 0;
  double stiffness_n_per_m = 0;
  double damping_ns_per_m = 0;
  double critical_elongation = 0;
  /// Why there is no such set; empty when there is one.
  std::string reason;

  bool usable() const { return reason.empty(); }
};

/// Root mean square of differences over the types; equal infinities differ by nothing.
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

/// Throws InputError at `where` unless every number is what a spring can have: natural lengths
/// above 0, stiffness, damping and critical elongation 0 or more (the last may be infinite: no
/// limit), at least one stiffness above 0.
void require_possible(const SpringParameters& springs, const std::string& where);

}  // namespace clothfit
