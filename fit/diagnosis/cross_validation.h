#pragma once

#include <limits>
#include <vector>

#include "fit/diagnosis/fitted_model.h"

namespace clothfit {

/// Errors on observations that a fit does not see, each block of them left out in turn: chi-square
/// per observation there.
struct CrossValidation {
  bool usable = false;
  std::vector<double> block;  ///< of each block that was left out
  double mean = 0;            ///< over all observations
  /// The same where predictions are mended without physics: a constant offset per marker, from what
  /// was seen; the residual of the nearest seen frame before the block (after it for the first),
  /// held.
  double constant_offset = 0, last_residual = 0;
  /// Or where forces without a law (FreeForces, two stretches to a block) are estimated along, the
  /// last ones before a block (after it for the first) held throughout it; infinite where that was
  /// not asked for.
  double free_forces = std::numeric_limits<double>::infinity();
};

/// Leaves out each of `blocks` stretches of frames of equal length, of all recordings at once (not
/// the first one where a start is unknown, for those frames show it); or,
/// of several recordings, each whole one (`whole`), whose own parameters then follow the shared
/// ones as its observations ask. Each time the model takes one Gauss-Newton step from its optimum
/// to where the others' optimum lies, which is exact where the model is linear, and is run again;
/// so do the amounts by which its discretisation errs. Squares beyond `threshold` sigmas count
/// linearly (Huber).
///
/// Free forces are asked for by the mesh that their derivatives are taken from, the model's own or
/// a coarser one. Together with all else they are what the same least squares makes of them to
/// first order, each known to be of one size beforehand: of 0.01, 0.1, 1 and 10 m/s2 the one that
/// foresees best. Forces are each recording's own, so that of one that is left out whole nothing
/// can be known of them.
CrossValidation cross_validate(const DiagnosisSetup& setup, const FittedModel& model, int blocks,
                               double threshold, bool whole = false,
                               const DiagnosisSetup* forces_mesh = nullptr);

}  // namespace clothfit
