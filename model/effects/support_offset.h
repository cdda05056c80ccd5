#pragma once

#include <memory>

#include "model/cloth/effect.h"

/// Holds points that follow a motion beside the places it gives, all by the same constant:
///
///   shift = offset
///
/// at every time, the rest before the start included. A tracker may see a corner of the cloth
/// beside its place in the clamp. A tool's path may lead elsewhere on the tool than to the clamp.
/// Points that rest are held where the cloth started, and are not shifted. Parameters: offset_x,
/// offset_y, offset_z (m), neutral at 0. Ours.
namespace clothfit::support_offset {

EffectDescription describe();
std::unique_ptr<Effect> make();

}  // namespace clothfit::support_offset
