#pragma once

#include <memory>

#include "model/cloth/effect.h"

/// Adds the inertia of air that moves along with the surface. It is a mass mu A beside the vertex's
/// own, in the direction of the normal only. The sum F of all forces but the weight m g becomes
///
///   F' = F - (mu A / (m + mu A)) n [n . (F + m g)]
///
/// so that the acceleration g + F'/m is (F + m g) / (m + mu A) along n and (F + m g) / m across it:
/// air has inertia and, floating in air, no weight. Ours; the force by which air resists the
/// turning of its own momentum with the surface is left out, which is of second order in the
/// velocity. A is the area that belongs to the vertex, n its unit normal. Parameter: mu (kg/m2),
/// neutral at 0. For a rigid disc of radius a in air of density rho it is 8 rho a / (3 pi) on
/// average.
namespace clothfit::added_air_mass {

EffectDescription describe();
std::unique_ptr<Effect> make();

}  // namespace clothfit::added_air_mass
