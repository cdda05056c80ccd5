#pragma once

#include <memory>

#include "model/cloth/effect.h"

/// Keeps the cloth out of an obstacle of triangles: the cloth's `obstacle`
/// (model/topology/obstacle.h). A vertex below its surface feels the force of contact_law.h towards
/// the nearest point of the surface; a cloth without an obstacle feels nothing.
///
/// Parameters: stiffness (Pa/m), damping (Pa s/m), friction (ratio), neutral at 0.
namespace clothfit::contact_mesh {

EffectDescription describe();
std::unique_ptr<Effect> make();

}  // namespace clothfit::contact_mesh
