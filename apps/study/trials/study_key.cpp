#include "apps/study/trials/study_key.h"

namespace clothfit {

void add_fields(const SyntheticScene& scene, JournalKey& key) {
  const Fabric& fabric = scene.fabric;
  key.add("size_m", scene.size_m).add("mass_kg", scene.mass_kg);
  key.add("tension_warp", fabric.tension_warp_n_per_m);
  key.add("tension_weft", fabric.tension_weft_n_per_m);
  key.add("shear", fabric.shear_n_per_m);
  key.add("flexion_warp", fabric.flexion_warp_n_per_m);
  key.add("flexion_weft", fabric.flexion_weft_n_per_m);
  key.add("damping_warp", fabric.damping_warp_s).add("damping_weft", fabric.damping_weft_s);
  key.add("drag_per_s", scene.drag_per_s).add("integrator", to_string(scene.integrator));
  key.add("truth_mesh", scene.truth_mesh).add("truth_steps", scene.truth_steps);
  key.add("markers", scene.markers).add("frames", scene.frames);
  key.add("held_out_from", scene.held_out_from).add("frame_rate_hz", scene.frame_rate_hz);
  key.add("before_s", scene.before_s).add("cameras", scene.cameras).add("hand", scene.hand);
  key.add("noise_m", scene.noise_m).add("noise_px", scene.noise_px).add("noisy", scene.noisy);
  key.add("missing", scene.missing).add("outliers", scene.outliers);
}

void add_fields(const FitOptions& fit, JournalKey& key) {
  key.add("observations", static_cast<int>(fit.observations));
  key.add("mesh_columns", fit.mesh_columns).add("mesh_rows", fit.mesh_rows);
  key.add("population", fit.population).add("generations", fit.generations);
  key.add("refine_best", fit.refine_best).add("loss", static_cast<int>(fit.loss));
  key.add("start_nodes", fit.start_nodes).add("substep_scale", fit.substep_scale);
}

}  // namespace clothfit
