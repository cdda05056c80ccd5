#pragma once

#include <memory>
#include <string>

#include "model/cloth/effect.h"

/// An empirical tension inside the springs: beyond k (l - l0) + c dl/dt,
///
///   tension += k l0 (c e^2 + cr |e'| e')
///
/// with e = (l - l0) / l0 the elongation and e' = (dl/dt) / l0 its rate; c one of two numbers,
/// stretched where e > 0 and compressed where e < 0; for the warp (structural springs along t), the
/// weft (along s) and the shear springs each. Forces are along the springs, so that momentum and
/// angular momentum stay. Beyond |e| = 0.05 and |e'| = 10/s each term goes straight on along its
/// tangent: a stiffness without bound is one that no time step follows. Within the coefficients'
/// bounds the stiffness is 0.1 to 5 times the springs'.
///
/// It says what a tension looks like and names no cause: with force_law the dictionary from which a
/// diagnosis proposes a law (fit/diagnosis/proposed_law.h). Every coefficient is neutral at 0.
/// Ours; see docs/effects.
namespace clothfit::tension_law {

EffectDescription describe();
std::unique_ptr<Effect> make();

/// What a coefficient multiplies, in a formula for T / (k l0): "e_warp^2 (e > 0)".
std::string term_text(const std::string& parameter);

}  // namespace clothfit::tension_law
