#pragma once

#include <Eigen/Core>

#include "model/fabric/spring_vector.h"

namespace clothfit {

/// The founding paper's reduced parameter set [louchet1995, section 3.1] for an isotropic fabric.
/// Its springs share one stiffness and one critical elongation (its "elongation rate"), with a
/// natural length for each pair of types. The paper's springs carry no dashpots.
struct Louchet5 {
  double natural_length_01_m = 0;  ///< l01, types 0 and 1, > 0
  double natural_length_23_m = 0;  ///< l23, types 2 and 3, > 0
  double natural_length_45_m = 0;  ///< l45, types 4 and 5, > 0; beyond 2 l01: planar rigidity
  double stiffness_n_per_m = 0;    ///< K, > 0
  double critical_elongation = SpringParameters::kInfinite;  ///< tau, >= 0; infinite: no limit

  static constexpr int kCount = 5;
  using Vector = Eigen::Matrix<double, kCount, 1>;  ///< in the order above
};

Louchet5::Vector to_vector(const Louchet5& set);
Louchet5 louchet5_of(const Louchet5::Vector& numbers);

/// Returns the six types of springs of this set. Throws nothing: see require_possible.
SpringParameters spring_parameters(const Louchet5& set);

/// Returns d springs / d set. Constant: each of the springs' numbers is one of the set's, or 0.
Eigen::Matrix<double, kSpringNumbers, Louchet5::kCount> springs_by_louchet5();

/// Finds the set nearest to given springs in least squares: each number is a mean over its springs.
/// There is none where some types have a limit and others do not.
Nearest<Louchet5> nearest_louchet5(const SpringParameters& springs);

/// Returns d set / d springs. Constant, for springs with limits.
Eigen::Matrix<double, Louchet5::kCount, kSpringNumbers> louchet5_by_springs();

}  // namespace clothfit
