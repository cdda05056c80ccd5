#pragma once

#include <Eigen/Core>
#include <array>

#include "model/fabric/spring_vector.h"

namespace clothfit {

/// The founding paper's general parameter set for a homogeneous fabric [louchet1995, section 3.1]:
/// three numbers for each of the six types of springs. The paper's springs carry no dashpots.
struct Louchet18 {
  std::array<double, kSpringTypes> stiffness_n_per_m{};  ///< K, >= 0
  std::array<double, kSpringTypes> natural_length_m{};   ///< l0, > 0
  /// tau, >= 0; infinite: no limit.
  std::array<double, kSpringTypes> critical_elongation = SpringParameters::kNoLimit;

  static constexpr int kCount = 3 * kSpringTypes;
  using Vector = Eigen::Matrix<double, kCount, 1>;  ///< in the order above, types rising
};

Louchet18::Vector to_vector(const Louchet18& set);
Louchet18 louchet18_of(const Louchet18::Vector& numbers);

/// Returns the six types of springs of this set. Throws nothing: see require_possible.
SpringParameters spring_parameters(const Louchet18& set);

/// Returns d springs / d set. Constant: each of the springs' numbers is one of the set's, or 0.
Eigen::Matrix<double, kSpringNumbers, Louchet18::kCount> springs_by_louchet18();

/// Returns the set of given springs: the same ones but for dashpots, which it lacks.
Nearest<Louchet18> nearest_louchet18(const SpringParameters& springs);

/// Returns d set / d springs. Constant.
Eigen::Matrix<double, Louchet18::kCount, kSpringNumbers> louchet18_by_springs();

}  // namespace clothfit
