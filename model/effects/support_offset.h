#pragma once

#include <memory>

#include "model/cloth/effect.h"

/// Held points that follow a motion are held beside where that has them, all by the same constant:
///
///   shift = offset
///
/// at every time, the rest before the start included. A tracker that sees a corner of the cloth
/// beside where the clamp has it says so, and a tool's path that leads elsewhere on the tool than
/// to the clamp. Points that rest are held where the cloth started, and are not shifted.
/// Parameters: offset_x, offset_y, offset_z (m), neutral at 0. Ours.
namespace clothfit::support_offset {

EffectDescription describe();
std::unique_ptr<Effect> make();

}  // namespace clothfit::support_offset
