#pragma once

#include <memory>

#include "model/cloth/effect.h"

/// Moves the held points to and fro, all alike, beside their known motion:
///
///   shift(t) = amplitude [sin(2 pi (f t + phase)) - sin(2 pi phase)]
///
/// with t the recording's time (s), so that the shift is nothing at 0, where the start shape holds.
/// Parameters: amplitude_x, amplitude_y, amplitude_z (m), neutral at 0; frequency f (Hz) and phase
/// (turns), which matter only where the amplitude does. A motion at constant velocity is
/// support_drift's. Ours.
namespace clothfit::support_motion {

EffectDescription describe();
std::unique_ptr<Effect> make();

}  // namespace clothfit::support_motion
