#include "model/fabric/spring_vector.h"

#include <algorithm>
#include <cmath>

#include "data/input_error.h"

namespace clothfit {
namespace {

using Numbers = std::array<double, kSpringTypes>;

auto block(const Numbers& numbers) {
  return Eigen::Map<const Eigen::Matrix<double, kSpringTypes, 1>>(numbers.data());
}

void copy_block(const SpringVector& from, SpringBlock at, Numbers& to) {
  std::copy_n(from.data() + at, kSpringTypes, to.data());
}

}  // namespace

SpringVector to_vector(const SpringParameters& springs) {
  SpringVector numbers;
  numbers << block(springs.natural_length_m), block(springs.stiffness_n_per_m),
      block(springs.damping_ns_per_m), block(springs.critical_elongation);
  return numbers;
}

SpringParameters springs_of(const SpringVector& numbers) {
  SpringParameters springs;
  copy_block(numbers, natural_length_block, springs.natural_length_m);
  copy_block(numbers, stiffness_block, springs.stiffness_n_per_m);
  copy_block(numbers, damping_block, springs.damping_ns_per_m);
  copy_block(numbers, elongation_block, springs.critical_elongation);
  return springs;
}

double rms_difference(const Numbers& a, const Numbers& b) {
  double sum = 0;
  for (size_t type = 0; type < kSpringTypes; ++type) {
    if (a[type] == b[type]) continue;  // infinity minus infinity is not a number
    sum += (a[type] - b[type]) * (a[type] - b[type]);
  }
  return std::sqrt(sum / kSpringTypes);
}

void require_possible(const SpringParameters& springs, const std::string& where) {
  const auto require = [&](bool good, const std::string& name, size_t type, double value,
                           const std::string& expected) {
    if (good) return;
    throw InputError(
        where, name + " of type " + std::to_string(type) + " = " + std::to_string(value), expected);
  };
  for (size_t type = 0; type < kSpringTypes; ++type) {
    const double natural_m = springs.natural_length_m[type];
    const double stiffness = springs.stiffness_n_per_m[type];
    const double damping = springs.damping_ns_per_m[type];
    const double elongation = springs.critical_elongation[type];
    require(natural_m > 0 && std::isfinite(natural_m), "natural length", type, natural_m,
            "metres, above 0");
    require(stiffness >= 0 && std::isfinite(stiffness), "stiffness", type, stiffness,
            "newtons per metre, 0 or more");
    require(damping >= 0 && std::isfinite(damping), "damping", type, damping,
            "newton seconds per metre, 0 or more");
    require(elongation >= 0, "critical elongation", type, elongation,
            "a share of the natural length, 0 or more");
  }
  if (*std::ranges::max_element(springs.stiffness_n_per_m) == 0)
    throw InputError(where, "every stiffness is 0", "at least one type of spring above 0");
}

}  // namespace clothfit
