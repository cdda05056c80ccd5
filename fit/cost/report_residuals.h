#pragma once

#include "fit/interface/fit_report.h"
#include "fit/problem/predictor.h"

namespace clothfit {

/// What the model leaves of the observations, beside what the trivial predictors leave: fills
/// `report.residuals` and `report.result.errors`. `run` is the free run over all frames.
void fill_residuals(const FitProblem& problem, const Predictor& predictor, const MarkerRun& run,
                    FitReport& report);

}  // namespace clothfit
