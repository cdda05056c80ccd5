#pragma once

#include <memory>

#include "model/cloth/effect.h"

/// Keeps the cloth from passing through itself. Between every two vertices that are not neighbours,
/// closer than the thickness d,
///
///   F = stiffness A_a A_b (d - r) / d^2  along their connection, apart
///
/// r is their distance. A_a, A_b are the areas that belong to them in the flat cloth, so that the
/// sum over vertices stands for an integral over both sheets and survives a change of mesh.
/// Parallel sheets at the distance z press each other apart by
///
///   p = pi stiffness z (d - z)^2 / d^2.
///
/// Vertices are not neighbours if they are apart by 2 d or more in the flat cloth, and by more than
/// two columns or rows, so that no spring joins them. (Sheets that a fold brings together at
/// distance d are at least pi d / 2 of cloth apart.) Where d is less than the mesh's spacing,
/// sheets slip through between the vertices. Ours.
///
/// Parameters: stiffness (Pa/m), neutral at 0; thickness d (m), which matters only where stiffness
/// does.
namespace clothfit::self_contact {

EffectDescription describe();
std::unique_ptr<Effect> make();

}  // namespace clothfit::self_contact
