#pragma once

#include "model/rest/minimise.h"

namespace clothfit {

/// Minimises by truncated Newton steps, preconditioned by multigrid.
///
///   (H + s M) d = -gradient,   x += step * d
///
/// H is the energy's second derivative. While the forces are far from balance, the cloth buckles in
/// many places at once and the exact H is indefinite: the negative transverse stiffness of
/// compressed springs is then taken for zero. Nearer to balance H is exact, until a direction of
/// negative curvature turns up. Conjugate gradients, preconditioned by LatticeMultigrid, solve the
/// linear system only as closely as the gradient deserves. The shift s M stands for the inertia of
/// a cloth that moves from rest to rest within 1 / sqrt(s). It bounds steps where the cloth has no
/// stiffness, as across a flat sheet, falls where steps succeed and rises where they do not.
///
/// `first_shift_per_s2` > 0 is s of the first step: a hundred times the squared rate of a pendulum
/// of the cloth's height suits a start that is far from equilibrium. Moves `position_m`, in which
/// held points are in place.
MinimiseResult minimise_by_newton(HeldEnergy& energy, const StopRule& stop,
                                  double first_shift_per_s2, MeshField& position_m);

/// Returns the squared rate of a pendulum of the cloth's height (1/s^2).
double pendulum_shift_per_s2(const HangingCloth& cloth);

}  // namespace clothfit
