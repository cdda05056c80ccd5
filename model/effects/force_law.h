#pragma once

#include <memory>
#include <string>

#include "model/cloth/effect.h"

/// Adds an empirical force on every vertex. One part goes with its mass m, the other with its area
/// A along the surface's normal n; each is a sum of terms with a coefficient of its own,
///
///   F = m sum_k c_k a_k(v, place, height, time) + A sum_k c_k p_k(v, n, place)
///
/// a_k: drag -v, -|v| v, the same of the velocity v_t in the surface, and -v over the cloth's width
/// and height; the unit vectors x, y, z, alone, times the height above the world's origin and times
/// the recording's time. p_k: drag -v_n and -|v_n| v_n with v_n = (n . v) n; n, alone and over the
/// cloth; (n . x) n and its like of y and z, the pressure of air that blows along them. "Over the
/// cloth" means times 2 s / w - 1 or 2 t / h - 1, from -1 at one edge to 1 at the other.
///
/// The effect describes a force and names no cause. It is the dictionary of a sparse regression in
/// the manner of [brunton2016], from which a diagnosis proposes a law
/// (fit/diagnosis/proposed_law.h). Every coefficient is neutral at 0; those of the uniform drags
/// are never negative, for still air takes energy and gives none. Ours; see docs/effects.
namespace clothfit::force_law {

EffectDescription describe();
std::unique_ptr<Effect> make();

/// Says whether a coefficient's force goes with the area, and not with the mass.
bool acts_on_area(const std::string& parameter);

/// Returns a coefficient's factor in a formula for a force per mass or per area: "-|v| v".
std::string term_text(const std::string& parameter);

}  // namespace clothfit::force_law
