#pragma once

#include <optional>
#include <string>
#include <vector>

#include "fit/measurement_effects/measurement_effect.h"
#include "fit/observe/observations.h"

namespace clothfit {

/// Why an effect of the measurement says nothing, or something wrong, of a recording.
struct Inapplicable {
  std::string problem;   ///< what the recording has that it cannot go with, such as 3D tracks
  std::string expected;  ///< what it should have, and why
};

/// What of a fit decides whether an effect of the measurement applies.
struct MeasurementSetting {
  const std::vector<ObservationSet>& observations;
  bool tracks_held_points = false;
  bool limits_strain = false;  ///< by moving vertices without their velocities
};

/// Nothing where `effect` applies.
std::optional<Inapplicable> why_inapplicable(const MeasurementEffect& effect,
                                             const MeasurementSetting& setting);

}  // namespace clothfit
