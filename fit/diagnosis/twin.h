#pragma once

#include <cstdint>

#include "fit/interface/fit_input.h"
#include "fit/interface/fit_report.h"

namespace clothfit {

/// Makes a recording as it would be if a model were the truth. Frames, markers, gaps, cameras and
/// drive stay the same. Every observation lies where the model has it, with normal noise of its own
/// sigma. `truth` is a report of that model on this recording. What the model puts behind a camera
/// is left out.
FitInput twin_of(FitInput recording, const FitReport& truth, std::uint64_t seed);

}  // namespace clothfit
