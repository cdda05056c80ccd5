#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "apps/study/trials/recover.h"

namespace clothfit {

/// These functions test intervals when the model is wrong in a known way: the truth has drag of the
/// air that the fit lacks. Its estimates then tend to pseudo-true values, not to the true ones.

/// Values on which fits of many releases would agree. Each parameter has its value in the fit,
/// without the drag, that minimises the residuals of all releases' noise-free recordings together.
struct PseudoTruth {
  bool usable = false;
  bool converged = false;
  std::string message;
  std::map<std::string, double> values;  ///< by the parameter's name
  int releases = 0;
};
/// Finds them from `releases` (>= 1) recordings of the study's scene. They are drawn from
/// `study.seed`, none of them one of its trials.
PseudoTruth pseudo_truth(const RecoverOptions& study, int releases,
                         const ProgressCallback& progress);

/// Returns the sigma of the drag by Cramer and Rao's bound, root mean square over releases. It is
/// the unit of a planted drag.
double drag_sigma_per_s(const RecoverOptions& study, int releases);

/// Intervals of one parameter over the trials of a study.
struct PlantedDragRow {
  std::string parameter;
  int trials = 0, undetermined = 0;
  double truth = 0, pseudo_truth = 0;
  Coverage90 holds_pseudo_truth, holds_truth;
};
std::vector<PlantedDragRow> planted_drag_rows(const RecoverResult& result,
                                              const PseudoTruth& pseudo);

}  // namespace clothfit
