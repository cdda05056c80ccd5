#include "fit/refine/other_mesh.h"

#include <algorithm>
#include <cassert>

namespace clothfit {

OtherMesh fit_on_other_mesh(const FitProblem& other, const Eigen::VectorXd& values,
                            const RefineOptions& options, const ProgressCallback& progress) {
  assert(other.space.size() == values.size());
  const RefineResult refined = refine(other, other.first_held_out, values, options, progress);
  OtherMesh result{.usable = refined.usable,
                   .message = refined.message,
                   .columns = other.cloth.mesh.columns,
                   .rows = other.cloth.mesh.rows,
                   .shift = {}};
  if (result.usable) result.shift = refined.values - values;
  return result;
}

}  // namespace clothfit
