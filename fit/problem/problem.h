#pragma once

#include "fit/problem/fit_problem.h"

namespace clothfit {

/// Reads a problem from the input. `mesh_columns` x `mesh_rows` is the mesh of the fit. Throws
/// InputError for a recording that cannot be fitted as it stands.
FitProblem make_problem(const FitInput& input, const FitOptions& options, int mesh_columns,
                        int mesh_rows);

}  // namespace clothfit
