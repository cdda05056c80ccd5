#pragma once

#include <optional>
#include <string>

#include "fit/measurement_effects/measurement_effect.h"
#include "fit/problem.h"

namespace clothfit {

/// Why an effect of the measurement says nothing, or something wrong, of a recording.
struct Inapplicable {
  std::string problem;   ///< what the recording has that it cannot go with, such as 3D tracks
  std::string expected;  ///< what it should have, and why
};

/// Nothing where `effect` applies to the problem, as far as its observations, held points and
/// springs are known.
std::optional<Inapplicable> why_inapplicable(const MeasurementEffect& effect,
                                             const FitProblem& problem);

}  // namespace clothfit
