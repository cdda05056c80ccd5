#pragma once

#include <memory>

#include "model/cloth/effect.h"

/// Keeps the cloth out of a ball. A vertex at x is depth = radius - |x - centre| inside it and
/// feels the force of contact_law.h along n = (x - centre) / |x - centre|.
///
/// Parameters: stiffness (Pa/m), damping (Pa s/m), friction (ratio), neutral at 0; centre_x,
/// centre_y, centre_z, radius (m), which matter only where stiffness or damping do.
namespace clothfit::contact_sphere {

EffectDescription describe();
std::unique_ptr<Effect> make();

}  // namespace clothfit::contact_sphere
