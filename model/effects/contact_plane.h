#pragma once

#include <memory>

#include "model/cloth/effect.h"

/// Keeps the cloth on one side of a plane: floor, table, wall. A vertex at x is depth = offset - n
/// . x below it and feels the force of contact_law.h.
///
/// Parameters: stiffness (Pa/m), damping (Pa s/m), friction (ratio), neutral at 0; n_x, n_y, n_z,
/// whose direction is the plane's normal n, towards the free side; offset (m), the plane's distance
/// from the origin along n. Where the plane lies matters only where stiffness or damping do.
namespace clothfit::contact_plane {

EffectDescription describe();
std::unique_ptr<Effect> make();

}  // namespace clothfit::contact_plane
