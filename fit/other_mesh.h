#pragma once

#include <utility>

#include "fit/refine.h"

namespace clothfit {

/// Where a fit ends on a mesh of another resolution: the mesh's share of what is not known.
struct OtherMesh {
  bool usable = false;
  std::string message;  ///< one line for a person
  int columns = 0, rows = 0;
  /// Value there less value here of each parameter, in its unit.
  Eigen::VectorXd shift;
};

/// Columns and rows of the other mesh: half the cells each way where at least `least` vertices are
/// left a side, else twice as many, so that cells keep their proportions.
std::pair<int, int> other_mesh_of(int columns, int rows, int least);

/// Refines from `values`, the optimum on the fit's own mesh, on that of `other`, whose parameters
/// and observations are the same.
OtherMesh fit_on_other_mesh(const FitProblem& other, const Eigen::VectorXd& values,
                            const RefineOptions& options, const ProgressCallback& progress);

}  // namespace clothfit
