#include "fit/measurement_effects/applicability.h"

#include <algorithm>

namespace clothfit {

std::optional<Inapplicable> why_inapplicable(const MeasurementEffect& effect,
                                             const FitProblem& problem) {
  if (!problem.driving_markers.empty())
    return Inapplicable{"a held point that is tracked",
                        "held points that are fixed or follow a path: a track is measured as the "
                        "cloth is, and would have to be corrected too"};
  const bool between_frames = effect.shifts_time() || effect.mixes_neighbours();
  if (between_frames && problem.cloth.strain_limit.mode != StrainLimitMode::off)
    return Inapplicable{"springs with the paper's strain limit",
                        "--springs fabric: that limit moves vertices without their velocities, by "
                        "which a time is looked up between frames"};
  const auto has_camera = [](const ObservationSet& set) { return set.camera.has_value(); };
  if (effect.needs_camera() && !std::ranges::all_of(problem.observations, has_camera))
    return Inapplicable{"3D tracks",
                        "the pixels of cameras (--observations tracks2d): 3D tracks no longer show "
                        "which pixel they come from"};
  return std::nullopt;
}

}  // namespace clothfit
