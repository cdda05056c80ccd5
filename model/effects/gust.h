#pragma once

#include <memory>

#include "model/cloth/effect.h"

/// Adds a gust, wind that comes and goes: F = A [n . q sin(2 pi (f t + phase))] n at every vertex.
///
/// Ours: the founding paper's fluid force on a sheet at rest, A (n . q) n [louchet1995, section
/// 2.2], with one harmonic in time t (s, the recording's); the drag that goes with it is wind's. A
/// is the area that belongs to the vertex, n its unit normal. Parameters: q_x, q_y, q_z (Pa), the
/// pressure at the harmonic's height, neutral at 0; frequency f (Hz) and phase (turns), which
/// matter only where q does.
namespace clothfit::gust {

EffectDescription describe();
std::unique_ptr<Effect> make();

}  // namespace clothfit::gust
