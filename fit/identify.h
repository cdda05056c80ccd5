#pragma once

#include <vector>

#include "fit/basins.h"
#include "fit/fit.h"
#include "fit/problem.h"
#include "fit/refine.h"

namespace clothfit {

/// No mesh is made coarser than this many vertices a side.
inline constexpr int kSmallestMesh = 7;

/// The whole way to the optimum, search and refinement, as docs/theory/identification.md has it:
/// from a given start, and from the ranges where there is none or where it does not lead to an
/// optimum. `candidates` are what a search found on the way; `report` gets a line for each stage.
/// Throws InputError for a start with parameters that the problem lacks.
RefineResult identify(const FitInput& input, const FitProblem& problem, const FitOptions& options,
                      const ProgressCallback& progress, FitReport& report,
                      std::vector<Candidate>& candidates);

/// How its last stage refines.
RefineOptions final_refinement(const FitProblem& problem, const FitOptions& options);

}  // namespace clothfit
