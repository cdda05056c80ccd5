#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "fit/diagnosis/search.h"

namespace clothfit {

/// An amplitude that is planted on twins of the recordings.
struct Plant {
  Hypothesis hypothesis;
  std::string parameter;
  double beyond_neutral = 0;
};

/// The outcome of a search in twins.
struct PlantOutcome {
  Plant plant;
  bool ran = false;
  std::vector<Hypothesis> found;  ///< the first accepted, then those that cannot be told from it
  std::string why_not;            ///< where it did not run
  /// Tells whether the first effect found is the planted one, or one that cannot be told from it.
  bool named() const;
};

/// Simulates twins of the recordings and asks the search what the model lacks. The twins have the
/// fitted model and the planted amplitude, with noise of their own on top (fit/diagnosis/twin.h).
/// Without a plant (an empty hypothesis) nothing should be found: the check by re-injection.
PlantOutcome search_twins(const DiagnosisSetup& setup, const FittedModel& model, const Plant& plant,
                          const SearchOptions& options, std::uint64_t seed,
                          const ProgressCallback& progress);

}  // namespace clothfit
