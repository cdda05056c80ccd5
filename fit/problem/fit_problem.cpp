#include "fit/problem/fit_problem.h"

#include <algorithm>

#include "fit/measurement_effects/measurement_effect.h"

namespace clothfit {

void add_derivative_weights(FitProblem& problem) {
  const auto shifts_place = [](const FitProblem::MeasurementTerm& term) {
    return term.effect->shifts_place();
  };
  if (!problem.derivative_weights.empty()) return;
  if (std::ranges::none_of(problem.measurement, shifts_place)) return;
  const Mesh& mesh = problem.cloth.mesh;
  for (const SurfaceQuantity derivative : kSurfaceDerivatives)
    problem.derivative_weights.push_back(vertex_weights(
        make_surface(mesh.columns, mesh.rows, mesh.width_m, mesh.height_m, problem.marker_place_m,
                     SurfaceInterpolation::bicubic, derivative)));
}

MeasurementSetting measurement_setting(const FitProblem& problem) {
  return {.observations = problem.observations,
          .tracks_held_points = !problem.driving_markers.empty(),
          .limits_strain = problem.cloth.strain_limit.mode != StrainLimitMode::off};
}

}  // namespace clothfit
