#pragma once

#include "data/finding.h"
#include "fit/interface/fit_input.h"
#include "fit/interface/fit_options.h"

namespace clothfit {

/// Holds what a recording declares against itself: mass per area, gravity's size, times, the mesh.
/// It looks at no track. Throws InputError for an effect that nobody knows.
Findings check_declarations(const Recording& recording);

/// Holds what a recording declares against its own tracks, those held out among them, before
/// anything is fitted: units, the first sheet, gravity and the release, time, held points, markers,
/// the obstacle. What is certain is refused, what is likely is a warning. Where units or the order
/// of markers are refused, nothing is looked at that rests on them. Takes seconds at most. Throws
/// InputError where there is nothing to look at.
Findings check_recording(const FitInput& input, ObservationKind kind);

/// Throws InputError for the first finding that refuses the recording, if there is one. It says how
/// many more there are.
void refuse_wrong(const Findings& findings);

}  // namespace clothfit
