#pragma once

#include <memory>

#include "model/cloth/effect.h"

/// Adds drag that grows with the square of the speed, normal to the surface and along it. At every
/// vertex
///
///   F = -A/2 (c_n |v_n| v_n + c_t |v_t| v_t),  v_n = (n . v) n,  v_t = v - v_n
///
/// Source: the drag equation F = rho c A v^2 / 2 of every text on fluids, once for each direction.
/// The coefficients c_n, c_t here are rho c (kg/m3), the air's density included; both are neutral
/// at 0. A is the area that belongs to the vertex, n its unit normal. The force is smooth: |v| v
/// has a derivative at rest.
namespace clothfit::quadratic_drag {

EffectDescription describe();
std::unique_ptr<Effect> make();

}  // namespace clothfit::quadratic_drag
