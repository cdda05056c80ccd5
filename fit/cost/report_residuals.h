#pragma once

#include "fit/interface/fit_report.h"
#include "fit/problem/predictor.h"

namespace clothfit {

/// Fills `report.residuals` and `report.result.errors` with the errors of the model and of the
/// trivial predictors. `run` is the free run over all frames.
void fill_residuals(const FitProblem& problem, const Predictor& predictor, const MarkerRun& run,
                    FitReport& report);

}  // namespace clothfit
