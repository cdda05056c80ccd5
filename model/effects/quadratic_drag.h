#pragma once

#include <memory>

#include "model/cloth/effect.h"

/// Drag that grows with the square of the speed, normal to the surface and along it: at every
/// vertex
///
///   F = -A/2 (c_n |v_n| v_n + c_t |v_t| v_t),  v_n = (n . v) n,  v_t = v - v_n
///
/// Source: the drag equation F = rho c A v^2 / 2 of every text on fluids, once for each direction;
/// the coefficients c_n, c_t here are rho c (kg/m3), the air's density included. A is the area that
/// belongs to the vertex, n its unit normal. Both are neutral at 0. Smooth: |v| v has a derivative
/// at rest.
namespace clothfit::quadratic_drag {

EffectDescription describe();
std::unique_ptr<Effect> make();

}  // namespace clothfit::quadratic_drag
