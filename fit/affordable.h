#pragma once

#include "fit/interface/fit_input.h"
#include "fit/interface/fit_options.h"
#include "fit/problem/fit_problem.h"

namespace clothfit {

/// The least that a fit takes, by estimate where its parameters begin.
struct FitCost {
  double spring_steps = 0;  ///< every stage of the refinement once, and a generation of the search
  double bytes = 0;         ///< of the largest arrays that live at one time
};

FitCost least_cost(const FitProblem& problem, const FitOptions& options);

/// Throws InputError for a fit or a forecast beyond the limits (fit/problem/work_limits.h,
/// fit/problem/memory_limits.h), before anything is simulated.
void require_affordable(const FitInput& input, const FitProblem& problem,
                        const FitOptions& options);

}  // namespace clothfit
