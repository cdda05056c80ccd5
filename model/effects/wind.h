#pragma once

#include <memory>

#include "model/cloth/effect.h"

/// Lets wind press on the surface: F = A [n . (q - c v)] n at every vertex.
///
/// Source: the founding paper's fluid force C [n . (u - v)] n on vertex normals [louchet1995,
/// section 2.2]. Amplitudes are per area, so that they survive a change of mesh: C = c A, A the
/// area that belongs to the vertex, n its unit normal, and q = c u the pressure that the wind u
/// would exert on a sheet at rest that faces it. Parameters: c (Pa s/m), the drag along the normal,
/// and q_x, q_y, q_z (Pa); all neutral at 0. With c = 0 the wind does not depend on the cloth's
/// speed, with q = 0 the air is still.
namespace clothfit::wind {

EffectDescription describe();
std::unique_ptr<Effect> make();

}  // namespace clothfit::wind
