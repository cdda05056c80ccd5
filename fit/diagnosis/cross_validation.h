#pragma once

#include <limits>
#include <vector>

#include "fit/diagnosis/fitted_model.h"

namespace clothfit {

/// Errors on observations that a fit does not see, each block of them left out in turn. They are
/// chi-square per observation left out.
struct CrossValidation {
  bool usable = false;
  std::vector<double> block;  ///< of each block that was left out
  double mean = 0;            ///< over all observations
  /// The same where predictions are corrected without physics. The constant offset of a marker
  /// comes from the frames that were seen. The last residual is that of the nearest frame seen
  /// before the block, held throughout it; for the first block, of the nearest one after it.
  double constant_offset = 0, last_residual = 0;
  /// The same where forces without a law are estimated along (FreeForces, two stretches to a
  /// block). The last forces before a block are held throughout it; for the first block, the first
  /// ones after it. Infinite where they were not asked for.
  double free_forces = std::numeric_limits<double>::infinity();
};

/// Leaves out each of `blocks` stretches of frames in turn, of all recordings at once. The
/// stretches are of equal length. Where a start is unknown the first one stays, for its frames show
/// the start. With `whole` each of several recordings is left out as a whole instead. Its own
/// parameters then follow the shared ones as its observations ask. Each time the model takes one
/// Gauss-Newton step from its optimum to that of the other observations, and is run again. The step
/// is exact where the model is linear, and halved where it leaves more of what it sees. It moves
/// the amplitudes of the discretisation's errors too. Squares beyond `threshold` sigmas count
/// linearly (Huber).
///
/// Free forces are asked for by the mesh that their derivatives are taken from, the model's own or
/// a coarser one. The same least squares finds them to first order, together with all else. They
/// are known to be of one size beforehand: of 0.01, 0.1, 1 and 10 m/s2 the one counts that predicts
/// best. Forces are each recording's own, so nothing is known of those of a recording that is left
/// out as a whole.
CrossValidation cross_validate(const DiagnosisSetup& setup, const FittedModel& model, int blocks,
                               double threshold, bool whole = false,
                               const DiagnosisSetup* forces_mesh = nullptr);

}  // namespace clothfit
