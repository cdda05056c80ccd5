#pragma once

#include "data/progress.h"
#include "fit/refine/refine.h"

namespace clothfit {

/// The end of a fit on a mesh of another resolution. It is the mesh's share of what is not known.
struct OtherMesh {
  bool usable = false;
  std::string message;  ///< one line for a person
  int columns = 0, rows = 0;
  /// Value there less value here of each parameter, in its unit.
  Eigen::VectorXd shift;
};

/// Refines from `values`, the optimum on the fit's own mesh, on that of `other`, whose parameters
/// and observations are the same.
OtherMesh fit_on_other_mesh(const FitProblem& other, const Eigen::VectorXd& values,
                            const RefineOptions& options, const ProgressCallback& progress);

}  // namespace clothfit
