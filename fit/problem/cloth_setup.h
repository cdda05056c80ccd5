#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "data/recording.h"
#include "model/cloth/cloth.h"

namespace clothfit {

/// What recordings and model files say of a cloth, turned into the model's own terms: shared by
/// fits and simulations.

/// A cloth on a mesh of its own, with `mass_kg` spread as its description says; no held points, no
/// effects.
Cloth make_cloth(const ClothDescription& description, const Mesh& mesh, double mass_kg);

/// The obstacle of a cloth; nothing where there is no surface.
std::shared_ptr<const Obstacle> make_obstacle(const std::optional<SurfaceMesh>& surface);

/// The numbers given for an effect by the names of its own parameters: a vector [x, y, z] under
/// NAME stands for NAME_x, NAME_y and NAME_z. Throws InputError at `where` for a name or a number
/// of numbers that the effect does not have.
std::map<std::string, double> by_parameter(const EffectDescription& effect,
                                           const std::string& where,
                                           const std::map<std::string, std::vector<double>>& given);

}  // namespace clothfit
