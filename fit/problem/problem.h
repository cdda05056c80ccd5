#pragma once

#include <optional>
#include <string>

#include "fit/problem/fit_problem.h"

namespace clothfit {

/// Reads a problem from the input. `mesh_columns` x `mesh_rows` is the mesh of the fit. Throws
/// InputError for a recording that cannot be fitted as it stands.
FitProblem make_problem(const FitInput& input, const FitOptions& options, int mesh_columns,
                        int mesh_rows);

/// Says why a readout that cameras declare takes no part in a fit; nothing where it does, or where
/// none is declared.
std::optional<std::string> why_readout_is_not_used(const FitProblem& problem);

}  // namespace clothfit
