#pragma once

#include <memory>

#include "model/cloth/effect.h"

/// Holds two held points with motions of their own by one rigid body, which keeps their distance.
/// The known motions let the distance wander. With D from one to the other there, and L their
/// distance over the flat cloth,
///
///   shift = -+ share / 2 [(1 + slack) L D / |D| - D],
///
/// the body's middle and direction being those of the two. Tracks of a cloth's corners jump by more
/// than those of its inside, and a cloth whose corners come closer bulges. Parameters: share (1),
/// neutral at 0, and 1 for a rigid body; slack (1), which matters only where the share does, below
/// 0 where the cloth is held less than taut. The effect acts only with exactly two driven points.
/// Ours.
namespace clothfit::rigid_support {

EffectDescription describe();
std::unique_ptr<Effect> make();

}  // namespace clothfit::rigid_support
