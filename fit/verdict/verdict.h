#pragma once

#include "data/fit_result.h"

namespace clothfit {

/// The verdict's thresholds, as multiples of the floor (ObservationErrors). Raised, the
/// first lets small structure pass as good; the second lets a model that lacks an effect state
/// intervals. Both are a convention. On the foreign recordings models that lack nothing leave up
/// to 1.5 times the noise, those that lack something 3 times and more (docs/results.md).
///
/// On fitted frames the floor counts no more of the discretisation's error than is expected. That
/// costs a sound fit its `good` where mesh and time step err by far more than usual.
struct VerdictCriteria {
  double good = 1.5;
  double usable = 2.5;
};
inline constexpr VerdictCriteria kVerdict{};

/// Judges a fit by its errors, without contradicting markers and single outliers: the worse of the
/// error on held-out frames and on fitted ones, over the floor. Sets the verdict and its reason,
/// and withdraws what a model that lacks something cannot say: the states of its parameters become
/// `misfit`, without intervals. `converged` and the errors' discretisation must be set. Call it
/// once.
void judge(FitResult& result);

/// The worst error over its floor: fitted and held out.
struct ErrorsOverFloor {
  double fitted = 0, held_out = 0;
  double worst() const { return fitted > held_out ? fitted : held_out; }
};
ErrorsOverFloor errors_over_floor(const FitResult& result);

}  // namespace clothfit
