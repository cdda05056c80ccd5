#pragma once

#include <memory>
#include <string>

#include "model/effects/effect.h"

/// An empirical force, proportional to the mass it acts on: the acceleration of every vertex is a
/// sum of terms, each with a coefficient of its own,
///
///   F = m sum_k c_k f_k(v, n, place, height, time)
///
/// f_k: drag -v, -|v| v, and the same of the velocity's parts v_n = (n . v) n along the surface's
/// normal n and v_t = v - v_n in the surface; -v over the cloth's width and height; the unit
/// vectors x, y, z; n, alone and over the cloth; (n . x) n and its like of y and z, the pressure of
/// air that blows along them; x, y, z times the height above the world's origin
/// and times the recording's time. Over the cloth means times 2 s / w - 1 or 2 t / h - 1, from -1
/// at one edge to 1 at the other.
///
/// It says what a force looks like and names no cause: the dictionary of a sparse regression in the
/// manner of [brunton2016], from which a diagnosis proposes a law (fit/diagnosis/proposed_law.h).
/// Every coefficient is neutral at 0; those of the uniform drags are never negative, for still air
/// takes energy and gives none. Ours; see docs/effects.
namespace clothfit::force_law {

EffectDescription describe();
std::unique_ptr<Effect> make();

/// What a coefficient multiplies, in a formula for an acceleration: "-|v| v".
std::string term_text(const std::string& parameter);

}  // namespace clothfit::force_law
