#pragma once

#include "model/rest/minimise.h"

namespace clothfit {

/// Minimises by nonlinear conjugate gradients [lethanh2007, section 3] and moves `position_m`. They
/// start again with steepest descent where the directions have lost their conjugacy (Polak and
/// Ribiere's formula, not below zero). A line search goes to where the slope has fallen to a tenth,
/// by secants between bounds. Held points are in place in `position_m`.
MinimiseResult minimise_by_conjugate_gradients(HeldEnergy& energy, const StopRule& stop,
                                               MeshField& position_m);

}  // namespace clothfit
