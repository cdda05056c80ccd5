#pragma once

#include "data/progress.h"
#include "fit/interface/fit_input.h"
#include "fit/interface/fit_options.h"
#include "fit/interface/fit_report.h"

namespace clothfit {

/// Fits as `clothfit fit` does, and judges the outcome. What mesh and time step make is looked for
/// where that decides. Throws InputError as fit() does; a stop that `progress` asked for stands in
/// the report.
FitReport fit_and_judge(const FitInput& input, FitOptions options,
                        const ProgressCallback& progress);

}  // namespace clothfit
