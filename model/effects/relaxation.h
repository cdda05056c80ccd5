#pragma once

#include <memory>

#include "model/cloth/effect.h"

/// Relaxes stress by a Maxwell arm, a spring and a dashpot in series, beside every spring:
///
///   tension += ratio k l0 (e - s),  ds/dt = (e - s) / time,  e = (l - l0) / l0
///
/// where s is the dashpot's elongation, which is remembered. The step takes s implicitly, s_n =
/// (s_(n-1) + h / time e_n) / (1 + h / time): stable for every time, first order like the rest of
/// the scheme. Parameters: ratio, of the arm's stiffness to the spring's, neutral at 0; time (s), a
/// shape and no amplitude. Ours.
namespace clothfit::relaxation {

EffectDescription describe();
std::unique_ptr<Effect> make();

}  // namespace clothfit::relaxation
