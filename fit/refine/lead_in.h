#pragma once

#include <string>

#include "data/progress.h"
#include "fit/interface/fit_options.h"
#include "fit/problem/problem.h"

namespace clothfit {

/// The start of a refinement by the trajectory's cost, to which another cost has led.
struct LeadIn {
  bool usable = false;
  Eigen::VectorXd values;
  std::string stage;  ///< one line for the report: what was done, and how it ended
};

/// Lowers `options.cost`, which is not the trajectory's, over all fitted frames from `start`:
/// shooting on the coarse mesh, the founding paper's costs on the fit's own. Both problems have the
/// same parameters. Throws InputError for costs over states where there are no 3D tracks.
LeadIn lead_in(const FitProblem& problem, const FitProblem& coarse_problem,
               const FitOptions& options, const Eigen::VectorXd& start,
               const ProgressCallback& progress);

}  // namespace clothfit
