#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "data/recording.h"
#include "model/cloth/cloth.h"

namespace clothfit {

/// These functions turn a cloth as recordings and model files describe it into the model's terms.
/// Fits and simulations share them.

/// Makes a cloth on a mesh of its own, with `mass_kg` spread as its description says. It has no
/// held points and no effects.
Cloth make_cloth(const ClothDescription& description, const Mesh& mesh, double mass_kg);

/// Makes the obstacle of a cloth; nothing where there is no surface.
std::shared_ptr<const Obstacle> make_obstacle(const std::optional<SurfaceMesh>& surface);

/// Returns the numbers given for an effect by the names of its own parameters. A vector [x, y, z]
/// under NAME stands for NAME_x, NAME_y and NAME_z. Throws InputError at `where` for a name, or a
/// count of numbers, that the effect does not have.
std::map<std::string, double> by_parameter(const EffectDescription& effect,
                                           const std::string& where,
                                           const std::map<std::string, std::vector<double>>& given);

}  // namespace clothfit
