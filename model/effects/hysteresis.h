#pragma once

#include <memory>

#include "model/cloth/effect.h"

/// Adds dry friction inside the fabric: an elastoplastic element beside every spring (Prandtl's),
///
///   tension += ratio k l0 (e - p),  |e - p| <= yield,  e = (l - l0) / l0
///
/// where the plastic elongation p, which is remembered, follows e so far that the bound is kept. An
/// oscillation of amplitude E > yield loses 4 ratio k l0^2 yield (E - yield) per spring and cycle,
/// whatever its frequency. Parameters: ratio, of the element's stiffness to the spring's, neutral
/// at 0; yield, the elongation at which it slips, a shape and no amplitude. Both are ratios, so
/// they are the fabric's and not the mesh's. Ours.
namespace clothfit::hysteresis {

EffectDescription describe();
std::unique_ptr<Effect> make();

}  // namespace clothfit::hysteresis
