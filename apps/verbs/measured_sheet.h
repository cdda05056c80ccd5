#pragma once

#include "data/fabric_sheet.h"
#include "model/fabric/measured_fabric.h"

namespace clothfit {

/// Returns the numbers of a data sheet without their sigmas.
inline MeasuredFabric measured(const FabricSheet& sheet) {
  return {.areal_density_kg_per_m2 = sheet.areal_density_kg_per_m2.value,
          .tension_warp_n_per_m = sheet.tension_n_per_m.warp.value,
          .tension_weft_n_per_m = sheet.tension_n_per_m.weft.value,
          .shear_n_per_m = sheet.shear_n_per_m.value,
          .bending_warp_n_m = sheet.bending_n_m.warp.value,
          .bending_weft_n_m = sheet.bending_n_m.weft.value};
}

}  // namespace clothfit
