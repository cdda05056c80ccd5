#include "fit/problem/cloth_setup.h"

#include <algorithm>
#include <array>

#include "data/input_error.h"

namespace clothfit {

Cloth make_cloth(const ClothDescription& description, const Mesh& mesh, double mass_kg) {
  const Mesh reference{description.mesh_columns, description.mesh_rows, description.width_m,
                       description.height_m};
  return Cloth::of(mesh, description.masses == MassDistribution::equal
                             ? masses_equal(mesh, reference, mass_kg)
                             : masses_by_area(mesh, mass_kg));
}

std::shared_ptr<const Obstacle> make_obstacle(const std::optional<SurfaceMesh>& surface) {
  if (!surface) return nullptr;
  return std::make_shared<const Obstacle>(TriangleMesh{surface->vertex_m, surface->triangle});
}

std::map<std::string, double> by_parameter(
    const EffectDescription& effect, const std::string& where,
    const std::map<std::string, std::vector<double>>& given) {
  const auto is_parameter = [&](const std::string& name) {
    return std::ranges::find(effect.parameters, name, &EffectParameter::name) !=
           effect.parameters.end();
  };
  std::map<std::string, double> numbers;
  for (const auto& [key, values] : given) {
    const bool is_vector = is_parameter(key + "_x");
    if (!is_vector && !is_parameter(key)) {
      std::string known;
      for (const EffectParameter& parameter : effect.parameters)
        known += (known.empty() ? "" : ", ") + parameter.name;
      throw InputError(where, "effect " + effect.name + " has no parameter '" + key + "'",
                       "its parameters are " + known);
    }
    const size_t expected = is_vector ? 3 : 1;
    if (values.size() != expected)
      throw InputError(
          where, effect.name + "." + key + " has " + std::to_string(values.size()) + " numbers",
          is_vector ? "a vector [x, y, z]" : "one number");
    if (!is_vector) {
      numbers[key] = values.front();
      continue;
    }
    for (size_t axis = 0; axis < 3; ++axis)
      numbers[key + std::array{"_x", "_y", "_z"}[axis]] = values[axis];
  }
  return numbers;
}

}  // namespace clothfit
