#pragma once

#include <memory>
#include <string>

#include "model/cloth/effect.h"

/// Adds an empirical tension inside the springs: beyond k (l - l0) + c dl/dt,
///
///   tension += k l0 (c e^2 + cr |e'| e')
///
/// with e = (l - l0) / l0 the elongation and e' = (dl/dt) / l0 its rate. c is one of two numbers,
/// stretched where e > 0 and compressed where e < 0. The warp (structural springs along t), the
/// weft (along s) and the shear springs have numbers of their own. Forces are along the springs, so
/// momentum and angular momentum stay. Beyond |e| = 0.05 and |e'| = 10/s each term goes straight on
/// along its tangent, because no time step follows a stiffness without bound. Within the
/// coefficients' bounds the stiffness is 0.1 to 5 times the springs'.
///
/// The effect describes a tension and names no cause. With force_law it is the dictionary from
/// which a diagnosis proposes a law (fit/diagnosis/proposed_law.h). Every coefficient is neutral at
/// 0. Ours; see docs/effects.
namespace clothfit::tension_law {

EffectDescription describe();
std::unique_ptr<Effect> make();

/// Returns a coefficient's factor in a formula for T / (k l0): "e_warp^2 (e > 0)".
std::string term_text(const std::string& parameter);

}  // namespace clothfit::tension_law
