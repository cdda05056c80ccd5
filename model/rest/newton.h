#pragma once

#include "model/rest/minimise.h"

namespace clothfit {

/// Truncated Newton steps, preconditioned by multigrid.
///
///   (H + s M) d = -gradient,   x += step * d
///
/// H is the energy's second derivative with the negative transverse stiffness of compressed springs
/// taken for zero while the forces are far from balance, where the cloth buckles in many places at
/// once and the exact one is indefinite; below that the exact one, until a direction of negative
/// curvature turns up. The linear system is solved by conjugate gradients, preconditioned by
/// LatticeMultigrid, only as closely as the gradient deserves. The shift s M stands for the inertia
/// of a cloth that moves from rest to rest within 1 / sqrt(s): it bounds steps where the cloth has
/// no stiffness, as across a flat sheet, falls where steps succeed and rises where they do not.
///
/// `first_shift_per_s2` > 0 is s of the first step: a hundred times the squared rate of a pendulum
/// of the cloth's height suits a start that is far from equilibrium. Moves `position_m`, in which
/// held points are in place.
MinimiseResult minimise_by_newton(HeldEnergy& energy, const StopRule& stop,
                                  double first_shift_per_s2, MeshField& position_m);

/// The squared rate of a pendulum of the cloth's height (1/s^2).
double pendulum_shift_per_s2(const HangingCloth& cloth);

}  // namespace clothfit
