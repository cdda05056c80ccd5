#include "model/fabric/fabric.h"

namespace clothfit {

SpringParameters spring_parameters(const Fabric& fabric, const Mesh& mesh) {
  const double shear_damping_s = 0.5 * (fabric.damping_warp_s + fabric.damping_weft_s);
  SpringParameters springs;
  springs.natural_length_m = flat_lengths(mesh);
  springs.stiffness_n_per_m = {fabric.tension_warp_n_per_m, fabric.tension_weft_n_per_m,
                               fabric.shear_n_per_m,        fabric.shear_n_per_m,
                               fabric.flexion_warp_n_per_m, fabric.flexion_weft_n_per_m};
  const std::array<double, kSpringTypes> damping_s = {fabric.damping_warp_s, fabric.damping_weft_s,
                                                      shear_damping_s,       shear_damping_s,
                                                      fabric.damping_warp_s, fabric.damping_weft_s};
  for (size_t type = 0; type < kSpringTypes; ++type)
    springs.damping_ns_per_m[type] = damping_s[type] * springs.stiffness_n_per_m[type];
  return springs;
}

}  // namespace clothfit
