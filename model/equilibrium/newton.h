#pragma once

#include "model/equilibrium/lattice_multigrid.h"
#include "model/equilibrium/minimise.h"

namespace clothfit {

struct NewtonOptions {
  double first_shift_per_s2 = 0;  ///< of the first step; see minimise_by_newton
  Curvature curvature = Curvature::clamped;
  bool verbose = false;
};

MinimiseResult minimise_by_newton(HeldEnergy& energy, const StopRule& stop,
                                  const NewtonOptions& options, MeshField& position_m);

}  // namespace clothfit
