#include "model/fabric/louchet18.h"

#include <algorithm>

namespace clothfit {
namespace {

/// Places of the set's blocks in the springs' numbers.
constexpr std::array<SpringBlock, 3> kBlocks = {stiffness_block, natural_length_block,
                                                elongation_block};

}  // namespace

Louchet18::Vector to_vector(const Louchet18& set) {
  Louchet18::Vector numbers;
  double* to = numbers.data();
  for (const auto* block :
       {&set.stiffness_n_per_m, &set.natural_length_m, &set.critical_elongation})
    to = std::ranges::copy(*block, to).out;
  return numbers;
}

Louchet18 louchet18_of(const Louchet18::Vector& numbers) {
  Louchet18 set;
  const double* from = numbers.data();
  for (auto* block : {&set.stiffness_n_per_m, &set.natural_length_m, &set.critical_elongation}) {
    std::copy_n(from, kSpringTypes, block->data());
    from += kSpringTypes;
  }
  return set;
}

SpringParameters spring_parameters(const Louchet18& set) {
  return {.natural_length_m = set.natural_length_m,
          .stiffness_n_per_m = set.stiffness_n_per_m,
          .critical_elongation = set.critical_elongation};
}

Eigen::Matrix<double, kSpringNumbers, Louchet18::kCount> springs_by_louchet18() {
  return louchet18_by_springs().transpose();
}

Eigen::Matrix<double, Louchet18::kCount, kSpringNumbers> louchet18_by_springs() {
  Eigen::Matrix<double, Louchet18::kCount, kSpringNumbers> result;
  result.setZero();
  for (int block = 0; block < 3; ++block)
    for (int type = 0; type < kSpringTypes; ++type)
      result(kSpringTypes * block + type, kBlocks[static_cast<size_t>(block)] + type) = 1;
  return result;
}

Nearest<Louchet18> nearest_louchet18(const SpringParameters& springs) {
  Nearest<Louchet18> nearest;
  nearest.set = {.stiffness_n_per_m = springs.stiffness_n_per_m,
                 .natural_length_m = springs.natural_length_m,
                 .critical_elongation = springs.critical_elongation};
  measure_differences(springs, spring_parameters(nearest.set), nearest);
  return nearest;
}

}  // namespace clothfit
