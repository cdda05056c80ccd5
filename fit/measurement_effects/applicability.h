#pragma once

#include <optional>
#include <string>
#include <vector>

#include "fit/measurement_effects/measurement_effect.h"
#include "fit/observe/observations.h"

namespace clothfit {

/// The reason why an effect of the measurement says nothing, or something wrong, of a recording.
struct Inapplicable {
  std::string problem;   ///< property of the recording that rules it out, such as 3D tracks
  std::string expected;  ///< property that it should have, and why
};

/// Properties of a fit that decide whether an effect of the measurement applies.
struct MeasurementSetting {
  const std::vector<ObservationSet>& observations;
  bool tracks_held_points = false;
  bool limits_strain = false;  ///< by moving vertices without their velocities
};

/// Returns nothing where `effect` applies.
std::optional<Inapplicable> why_inapplicable(const MeasurementEffect& effect,
                                             const MeasurementSetting& setting);

}  // namespace clothfit
