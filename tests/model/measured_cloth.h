#pragma once

#include "model/fabric/measured_fabric.h"

namespace clothfit {

/// A fabric that differs along warp and weft.
inline const MeasuredFabric kMeasuredCloth{.areal_density_kg_per_m2 = 0.2,
                                           .tension_warp_n_per_m = 500,
                                           .tension_weft_n_per_m = 400,
                                           .shear_n_per_m = 40,
                                           .bending_warp_n_m = 8e-6,
                                           .bending_weft_n_m = 2e-6};

}  // namespace clothfit
