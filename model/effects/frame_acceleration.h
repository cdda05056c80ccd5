#pragma once

#include <memory>

#include "model/cloth/effect.h"

/// Shakes the frame of the whole scene. The inertial force is F = -m a sin(2 pi (f t + phase)) on
/// every vertex, supports at rest in the frame, t the recording's time (s).
///
/// Newton's second law in an accelerated frame. Parameters: a_x, a_y, a_z (m/s2), the frame's
/// acceleration at the harmonic's height, neutral at 0; frequency f (Hz) and phase (turns), which
/// matter only where a does.
namespace clothfit::frame_acceleration {

EffectDescription describe();
std::unique_ptr<Effect> make();

}  // namespace clothfit::frame_acceleration
