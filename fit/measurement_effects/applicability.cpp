#include "fit/measurement_effects/applicability.h"

#include <algorithm>

namespace clothfit {

std::optional<Inapplicable> why_inapplicable(const MeasurementEffect& effect,
                                             const MeasurementSetting& setting) {
  if (setting.tracks_held_points)
    return Inapplicable{"a held point that is tracked",
                        "held points that are fixed or follow a path: a track is measured as the "
                        "cloth is, and would have to be corrected too"};
  const bool between_frames = effect.shifts_time() || effect.mixes_neighbours();
  if (between_frames && setting.limits_strain)
    return Inapplicable{
        "springs with the paper's strain limit",
        "FitOptions::spring_set = fabric: that limit moves vertices without their velocities, by "
        "which a time is looked up between frames"};
  const auto has_camera = [](const ObservationSet& set) { return set.camera.has_value(); };
  if (effect.needs_camera() && !std::ranges::all_of(setting.observations, has_camera))
    return Inapplicable{
        "3D tracks",
        "the pixels of cameras (FitOptions::observations = tracks2d): 3D tracks no longer show "
        "which pixel they come from"};
  return std::nullopt;
}

}  // namespace clothfit
