#pragma once

#include <vector>

#include "data/progress.h"
#include "fit/cost/objective.h"
#include "fit/interface/fit_input.h"
#include "fit/interface/fit_options.h"
#include "fit/interface/fit_report.h"
#include "fit/problem/problem.h"
#include "fit/refine/refine.h"
#include "fit/uncertainty/basins.h"

namespace clothfit {

/// The whole way to the optimum, search and refinement, as docs/theory/identification.md has it:
/// from a given start, and from the ranges where there is none or where it does not lead to an
/// optimum. `candidates` are what a search found on the way; `report` gets a line for each stage.
/// Throws InputError for a start with parameters that the problem lacks.
RefineResult identify(const FitInput& input, const FitProblem& problem, const FitOptions& options,
                      const ProgressCallback& progress, FitReport& report,
                      std::vector<Candidate>& candidates);

/// Returns the mean square of whitened residuals without the tenth of the markers that leave most,
/// at least one of five: a few whose tracks are wrong say nothing of the model.
double misfit_of_most_markers(const Objective& objective, const Eigen::VectorXd& residual);

/// Returns the settings of its last stage.
RefineOptions final_refinement(const FitProblem& problem, const FitOptions& options);

}  // namespace clothfit
