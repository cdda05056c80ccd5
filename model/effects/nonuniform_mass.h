#pragma once

#include <memory>

#include "model/cloth/effect.h"

/// Spreads the mass otherwise than stated. At a vertex that carries r times its stated mass the sum
/// F of all forces but the weight becomes F / r, so that it moves by g + F / (r m), with
///
///   r = (1 + h) (1 + gradient_s (s - 1/2)) (1 + gradient_t (t - 1/2)) (1 + patch B)
///   h = hem H + hem_left H_l + hem_right H_r + hem_top H_t + hem_bottom H_b
///
/// H is the share of the vertex's part of the flat cloth (its hat function's) that lies within
/// hem_width of the border, so that the hem's mass and its moment are the same on every mesh. H_l
/// to H_b are the shares of one edge (left: s = 0, top: t = 0). s, t: place on the cloth as shares
/// of its width and height. B = (1 - u^2)^3 for u < 1, else 0, with u the distance from (patch_s,
/// patch_t) over patch_radius in the flat cloth. Ours.
///
/// The total is not kept: a hem or a patch weighs on top of the stated mass; gradients leave it
/// alone. Forces that other effects state per mass belong to the stated mass. Parameters: hem,
/// hem_left, hem_right, hem_top, hem_bottom, gradient_s, gradient_t, patch (ratios), neutral at 0;
/// hem_width (m), patch_s, patch_t (shares) and patch_radius (m), which matter only where a hem or
/// patch does.
namespace clothfit::nonuniform_mass {

EffectDescription describe();
std::unique_ptr<Effect> make();

}  // namespace clothfit::nonuniform_mass
