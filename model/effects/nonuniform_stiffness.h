#pragma once

#include <memory>

#include "model/cloth/effect.h"

/// Varies the stiffness over the cloth by a relative change of every spring and its dashpot:
///
///   tension += (f - 1) (k (l - l0) + c dl/dt)
///   f = (1 + patch b(|(s, t) - centre| / radius)) (1 + edge b(d / edge_width))
///       (1 + gradient_s (2 s - 1)) (1 + gradient_t (2 t - 1))
///   b(x) = (1 - x^2)^3 where x < 1, else 0
///
/// (s, t) is the spring's middle and d its distance from the border, all in shares of the cloth's
/// width and height. As a product of positive factors f stays positive within the bounds.
/// Amplitudes (patch, edge, gradient_s, gradient_t; ratios) are neutral at 0; patch_s, patch_t,
/// patch_radius and edge_width are places and sizes, not amplitudes. Ours; b is a bump of plain
/// arithmetic that is twice differentiable, so that its place can be fitted.
namespace clothfit::nonuniform_stiffness {

EffectDescription describe();
std::unique_ptr<Effect> make();

}  // namespace clothfit::nonuniform_stiffness
