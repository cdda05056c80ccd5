#pragma once

#include <cstdint>

#include "fit/uncertainty/linearised_fit.h"
#include "fit/uncertainty/space_time_blocks.h"

namespace clothfit {

/// Linear fits whose model is wrong in a smooth way, over 6 x 6 markers and 20 frames of a second.
/// Regressors and misfit are Gaussian fields over a cloth of 0.4 m and time, drawn for each
/// replicate, with white noise of variance 1 on top. The misfit is independent of the regressors,
/// so that the pseudo-true value of every coordinate is 0.
struct SmoothMisfit {
  double misfit_sigma = 2;  ///< sigma of the field, in units of the noise
  double range_m = 0.06;    ///< correlation length over the cloth, of misfit and regressors
  double range_s = 0.1;     ///< the same in time
  int coordinates = 3;
};

ObservationPlaces misfit_places();

struct MisfitReplicate {
  LinearisedFit fit;         ///< at its optimum
  Eigen::VectorXd estimate;  ///< one for each coordinate, pseudo-true value 0
};
MisfitReplicate draw_misfit(const SmoothMisfit& misfit, std::uint64_t seed, int replicate);

}  // namespace clothfit
