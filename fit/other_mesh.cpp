#include "fit/other_mesh.h"

#include <algorithm>
#include <cassert>

namespace clothfit {

std::pair<int, int> other_mesh_of(int columns, int rows, int least) {
  const auto coarser = [](int count) { return (count - 1) / 2 + 1; };
  if (std::min(coarser(columns), coarser(rows)) >= least) return {coarser(columns), coarser(rows)};
  return {2 * columns - 1, 2 * rows - 1};
}

OtherMesh fit_on_other_mesh(const FitProblem& other, const Eigen::VectorXd& values,
                            const RefineOptions& options, const ProgressCallback& progress) {
  assert(other.space.size() == values.size());
  const RefineResult refined = refine(other, other.first_held_out, values, options, progress);
  OtherMesh result{.usable = refined.usable && !refined.cancelled,
                   .message = refined.message,
                   .columns = other.cloth.mesh.columns,
                   .rows = other.cloth.mesh.rows,
                   .shift = {}};
  if (result.usable) result.shift = refined.values - values;
  return result;
}

}  // namespace clothfit
