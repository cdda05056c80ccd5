#pragma once

#include <memory>

#include "model/cloth/effect.h"

/// Gives the cloth a curvature at rest, as of one that was rolled up for long:
///
///   E = -integral (m_s x_ss . n + m_t x_tt . n) dA
///
/// over the flat cloth, n the unit normal (along s x t). With a bending stiffness B (effect
/// bending_energy) a free strip curls to the curvature m / B, towards n where m > 0; without one
/// nothing in the fabric balances the moment. Differences are as in bending_energy, n from the
/// differences to the neighbours. Forces are minus the derivative of the discrete energy, so they
/// sum to zero and exert no torque. Parameters: m_s, m_t (N, a moment per length), neutral at 0.
/// Ours.
namespace clothfit::rest_curvature {

EffectDescription describe();
std::unique_ptr<Effect> make();

}  // namespace clothfit::rest_curvature
