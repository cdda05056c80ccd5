#pragma once

#include <cstdint>

#include "fit/interface/fit_input.h"
#include "fit/interface/fit_report.h"

namespace clothfit {

/// A recording as it would be if a model were the truth: the same frames, markers, gaps, cameras
/// and drive, every observation where the model has it (`truth`: a report of that model on this
/// recording) with normal noise of its own sigma. What the model puts behind a camera is left out.
FitInput twin_of(FitInput recording, const FitReport& truth, std::uint64_t seed);

}  // namespace clothfit
