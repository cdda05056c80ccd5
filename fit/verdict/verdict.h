#pragma once

#include <optional>

#include "data/fit_result.h"

namespace clothfit {

/// The verdict's thresholds, as multiples of the floor (ObservationErrors::floor). Raised, the
/// first lets small structure pass as good; the second lets a model that lacks an effect state
/// intervals. Both are a convention. On the foreign recordings models that lack nothing leave up
/// to 1.5 times the noise, those that lack something 3 times and more (docs/results.md).
struct VerdictCriteria {
  double good = 1.5;
  double usable = 2.5;
};
inline constexpr VerdictCriteria kVerdict{};

/// Judges a fit by its errors, without the markers that contradict all others: the worse of the
/// error on held-out frames and on fitted ones, over the floor. Sets the verdict and its reason,
/// and withdraws what a model that lacks something cannot say: the states of its parameters become
/// `misfit`, without intervals. `converged` must be set. Call it once.
///
/// On held-out frames the floor takes the discretisation's error as it is expected
/// (ObservationErrors::discretisation): what parameters took up returns there. On fitted ones it
/// takes what was `found` of it, a root mean square over the noise; without that, what is expected.
void judge(FitResult& result, std::optional<double> found = std::nullopt);

/// The worst error over its floor: fitted and held out.
struct ErrorsOverFloor {
  double fitted = 0, held_out = 0;
  double worst() const { return fitted > held_out ? fitted : held_out; }
};
ErrorsOverFloor errors_over_floor(const FitResult& result,
                                  std::optional<double> found = std::nullopt);

}  // namespace clothfit
