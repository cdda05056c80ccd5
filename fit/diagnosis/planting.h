#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "fit/diagnosis/search.h"

namespace clothfit {

/// An amplitude of a law that is planted on twins of the recordings.
struct Plant {
  Term term;
  std::string parameter;
  double beyond_neutral = 0;
};

/// What a search makes of a twin.
struct PlantOutcome {
  Plant plant;
  bool ran = false;
  std::vector<Term> found;  ///< the first law accepted, then those that cannot be told from it
  std::string why_not;      ///< where it did not run
  /// Whether the planted effect, or one that cannot be told from it, was the first to be found.
  bool named() const;
};

/// Simulates the recordings with a fitted model and the planted amplitude, noise of their own on
/// top (fit/diagnosis/twin.h), and asks the search what the model lacks. Without a plant (an empty
/// term) nothing should be found: the check by re-injection.
PlantOutcome search_twins(const DiagnosisSetup& setup, const ModelFit& model, const Plant& plant,
                          const SearchOptions& options, std::uint64_t seed,
                          const ProgressCallback& progress);

}  // namespace clothfit
