#pragma once

#include <vector>

#include "fit/diagnosis/catalogue.h"
#include "fit/diagnosis/fitted_model.h"
#include "fit/jobs/phase_clock.h"

namespace clothfit {

struct SearchOptions {
  std::vector<ShapeCandidates> hypotheses;  ///< to test
  std::vector<Hypothesis> contacts;         ///< with obstacles in unknown places, to test too
  int beam_width = 3;                       ///< entries that are followed side by side
  int refits = 6;                           ///< hypotheses of each entry that are fitted at a time
  size_t most_effects = 4;
  /// Residuals beyond it count less (Huber), in sigmas; infinite for squares.
  double threshold = 1e300;
  PhaseClock* clock = nullptr;  ///< told of the search's phases; or null
};

/// The state that the steps of one search share.
struct SearchContext {
  SearchContext(const DiagnosisSetup& analysed, const SearchOptions& asked,
                const ProgressCallback& reported);
  SearchContext(const SearchContext&) = delete;
  SearchContext& operator=(const SearchContext&) = delete;

  const DiagnosisSetup& setup;
  /// The mesh only chooses: its own errors are not asked for, and no other basin is looked for.
  bool only_chooses = false;
  const DiagnosisSetup coarse;  ///< a mesh of half the cells a side, where there is one
  const SearchOptions& options;
  const ProgressCallback progress;
  double threshold;  ///< SearchOptions::threshold, in the basin where the base stands
  /// Chi-square and cost of the model that has found nothing.
  double base_chi_square = 0, base_cost = 0;
  /// The same model, where it was refined or changed its basin; else not run.
  FittedModel base;

  /// Says what the search is at.
  void enter(const std::string& phase) const {
    if (options.clock != nullptr) options.clock->enter(phase);
  }
  /// Returns chi-square, which is infinite for a model that is not usable.
  double left_by(const FittedModel& model) const;
  /// Returns chi-square and the price of a model's amplitudes, added up.
  double cost(const FittedModel& model) const;
  /// Returns the decrease from which one hypothesis more is worth a name beside a model.
  double worth(const FittedModel& model) const;
  /// Tells whether it leaves so much that its basin may be the wrong one. Its sigmas are then those
  /// of all that it lacks.
  bool is_far_off(const FittedModel& model) const;
  /// Tells whether a model does not have a hypothesis yet, and has what it refines.
  bool may_ask(const FittedModel& model, const Hypothesis& hypothesis) const;
  /// Returns hypotheses that a model does not have and may be asked for, at the shapes that it has
  /// for their effects.
  std::vector<ShapeCandidates> untested(const FittedModel& model) const;
};

}  // namespace clothfit
