#pragma once

#include "model/rest/minimise.h"

namespace clothfit {

/// Nonlinear conjugate gradients [lethanh2007, section 3], started again with steepest descent
/// where the directions have lost their conjugacy (Polak and Ribiere's formula, not below zero).
/// A line search goes to where the slope has fallen to a tenth, by secants between bounds. Moves
/// `position_m`, in which held points are in place.
MinimiseResult minimise_by_conjugate_gradients(HeldEnergy& energy, const StopRule& stop,
                                               MeshField& position_m);

}  // namespace clothfit
