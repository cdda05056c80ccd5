#include "model/fabric/louchet5.h"

#include <algorithm>
#include <cmath>

namespace clothfit {

Louchet5::Vector to_vector(const Louchet5& set) {
  return {set.natural_length_01_m, set.natural_length_23_m, set.natural_length_45_m,
          set.stiffness_n_per_m, set.critical_elongation};
}

Louchet5 louchet5_of(const Louchet5::Vector& numbers) {
  return {.natural_length_01_m = numbers[0],
          .natural_length_23_m = numbers[1],
          .natural_length_45_m = numbers[2],
          .stiffness_n_per_m = numbers[3],
          .critical_elongation = numbers[4]};
}

SpringParameters spring_parameters(const Louchet5& set) {
  SpringParameters springs;
  springs.natural_length_m = {set.natural_length_01_m, set.natural_length_01_m,
                              set.natural_length_23_m, set.natural_length_23_m,
                              set.natural_length_45_m, set.natural_length_45_m};
  springs.stiffness_n_per_m.fill(set.stiffness_n_per_m);
  springs.critical_elongation.fill(set.critical_elongation);
  return springs;
}

Eigen::Matrix<double, kSpringNumbers, Louchet5::kCount> springs_by_louchet5() {
  Eigen::Matrix<double, kSpringNumbers, Louchet5::kCount> result;
  result.setZero();
  for (int type = 0; type < kSpringTypes; ++type) {
    result(natural_length_block + type, type / 2) = 1;
    result(stiffness_block + type, 3) = 1;
    result(elongation_block + type, 4) = 1;
  }
  return result;
}

Eigen::Matrix<double, Louchet5::kCount, kSpringNumbers> louchet5_by_springs() {
  Eigen::Matrix<double, Louchet5::kCount, kSpringNumbers> result;
  result.setZero();
  for (int type = 0; type < kSpringTypes; ++type) {
    result(type / 2, natural_length_block + type) = 1.0 / 2;
    result(3, stiffness_block + type) = 1.0 / kSpringTypes;
    result(4, elongation_block + type) = 1.0 / kSpringTypes;
  }
  return result;
}

Nearest<Louchet5> nearest_louchet5(const SpringParameters& springs) {
  const auto is_infinite = [](double elongation) { return std::isinf(elongation); };
  const auto unlimited = std::ranges::count_if(springs.critical_elongation, is_infinite);
  Nearest<Louchet5> nearest;
  SpringVector numbers = to_vector(springs);
  if (unlimited > 0) numbers.segment<kSpringTypes>(elongation_block).setZero();
  nearest.set = louchet5_of(louchet5_by_springs() * numbers);
  if (unlimited > 0) nearest.set.critical_elongation = SpringParameters::kInfinite;
  if (unlimited > 0 && unlimited < kSpringTypes) {
    nearest.reason =
        "some types of springs have a critical elongation and others none: no common one is near "
        "to both";
    return nearest;
  }
  measure_differences(springs, spring_parameters(nearest.set), nearest);
  return nearest;
}

}  // namespace clothfit
