#pragma once

#include <vector>

#include "fit/diagnosis/model_fit.h"

namespace clothfit {

/// Errors on observations that a fit does not see, each block of them left out in turn: chi-square
/// per observation there.
struct CrossValidation {
  bool usable = false;
  std::vector<double> block;  ///< of each block
  double mean = 0;            ///< over all observations
  /// The same where predictions are mended without physics: a constant offset per marker, from what
  /// was seen; the residual of the nearest seen frame before the block (after it for the first),
  /// held.
  double constant_offset = 0, last_residual = 0;
};

/// Leaves out each of `blocks` stretches of frames of equal length, of all recordings at once; or,
/// of several recordings, each whole one (`whole`), whose own parameters then follow the shared
/// ones as its observations ask. Each time the model takes one Gauss-Newton step from its optimum
/// to where the others' optimum lies, which is exact where the model is linear, and is run again;
/// so do the amounts by which its discretisation errs. Squares beyond `threshold` sigmas count
/// linearly (Huber).
CrossValidation cross_validate(const DiagnosisSetup& setup, const ModelFit& model, int blocks,
                               double threshold, bool whole = false);

}  // namespace clothfit
