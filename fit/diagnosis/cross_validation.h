#pragma once

#include <map>
#include <string>
#include <vector>

#include "fit/diagnosis/model_fit.h"

namespace clothfit {

/// Errors on frames that a fit does not see, each block of time of its fitted frames left out in
/// turn: chi-square per observation there.
struct CrossValidation {
  bool usable = false;
  std::vector<double> block;  ///< of each block
  double mean = 0;            ///< over all observations
  /// The same where predictions are mended without physics: a constant offset per marker, from the
  /// frames that were seen; the residual of the nearest seen frame before the block (after it for
  /// the first), held.
  double constant_offset = 0, last_residual = 0;
};

/// Leaves out each of `blocks` stretches of frames of equal length. Each time the model takes one
/// Gauss-Newton step from its optimum to where the other frames' optimum lies, which is exact where
/// the model is linear, and is run again. Squares beyond `threshold` sigmas count linearly (Huber).
CrossValidation cross_validate(const DiagnosisSetup& setup, const ModelFit& model, int blocks,
                               double threshold);

}  // namespace clothfit
