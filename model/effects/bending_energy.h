#pragma once

#include <memory>

#include "model/cloth/effect.h"

/// Resists bending as a plate without lateral contraction does (Poisson's ratio 0):
///
///   E = B / 2 integral (x_ss^2 + x_tt^2 + 2 x_st^2) dA
///
/// over the flat cloth, x the place of the point (s, t). For cloth that keeps its lengths this is B
/// / 2 times the sum of the squared curvatures. Second differences are taken along rows and columns
/// at every vertex that has both neighbours, mixed differences in every cell; free edges carry no
/// moment. The energy is a quadratic form of differences, so the forces are linear in the positions
/// and the energy does not change when the cloth is moved or turned. Unlike the flexion springs it
/// does not vanish on refinement. Parameter: B (N m), neutral at 0. The discretisation is ours.
namespace clothfit::bending_energy {

EffectDescription describe();
std::unique_ptr<Effect> make();

}  // namespace clothfit::bending_energy
