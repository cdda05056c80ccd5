#include "model/fabric/spring_set.h"

#include "model/fabric/fabric_conversion.h"
#include "model/fabric/louchet18.h"
#include "model/fabric/louchet5.h"

namespace clothfit {

std::string to_string(SpringSet set) {
  switch (set) {
    case SpringSet::louchet5:
      return "louchet5";
    case SpringSet::louchet18:
      return "louchet18";
    case SpringSet::fabric:
      break;
  }
  return "fabric";
}

std::optional<SpringSet> spring_set_named(const std::string& name) {
  for (const SpringSet set : {SpringSet::fabric, SpringSet::louchet5, SpringSet::louchet18})
    if (to_string(set) == name) return set;
  return std::nullopt;
}

std::vector<SpringNumber> numbers_of(SpringSet set) {
  using enum SpringQuantity;
  switch (set) {
    case SpringSet::louchet5:
      return {{"natural_length_01", "m", natural_length, structural_t},
              {"natural_length_23", "m", natural_length, shear_down},
              {"natural_length_45", "m", natural_length, flexion_t},
              {"stiffness", "N/m", stiffness, structural_t},
              {"critical_elongation", "", critical_elongation, structural_t}};
    case SpringSet::louchet18: {
      std::vector<SpringNumber> numbers;
      const auto add = [&](const char* name, const char* unit, SpringQuantity quantity) {
        for (int type = 0; type < kSpringTypes; ++type)
          numbers.push_back({name + std::string("_") + std::to_string(type), unit, quantity, type});
      };
      add("stiffness", "N/m", stiffness);
      add("natural_length", "m", natural_length);
      add("critical_elongation", "", critical_elongation);
      return numbers;
    }
    case SpringSet::fabric:
      break;
  }
  return {{"tension_warp", "N/m", stiffness, structural_t},
          {"tension_weft", "N/m", stiffness, structural_s},
          {"shear", "N/m", stiffness, shear_down},
          {"flexion_warp", "N/m", stiffness, flexion_t},
          {"flexion_weft", "N/m", stiffness, flexion_s},
          {"damping_warp", "s", retardation_time, structural_t},
          {"damping_weft", "s", retardation_time, structural_s}};
}

SpringParameters springs_of(SpringSet set, const Eigen::VectorXd& numbers, const Mesh& mesh) {
  switch (set) {
    case SpringSet::louchet5:
      return spring_parameters(louchet5_of(numbers));
    case SpringSet::louchet18:
      return spring_parameters(louchet18_of(numbers));
    case SpringSet::fabric:
      break;
  }
  return spring_parameters(fabric_of(FabricVector(numbers)), mesh);
}

Eigen::MatrixXd springs_by_numbers(SpringSet set, const Eigen::VectorXd& numbers) {
  switch (set) {
    case SpringSet::louchet5:
      return springs_by_louchet5();
    case SpringSet::louchet18:
      return springs_by_louchet18();
    case SpringSet::fabric:
      break;
  }
  return springs_by_fabric(fabric_of(FabricVector(numbers)));
}

}  // namespace clothfit
