#pragma once

#include <vector>

#include "fit/diagnosis/fitted_model.h"
#include "fit/diagnosis/score.h"
#include "fit/diagnosis/search_context.h"
#include "fit/diagnosis/trial.h"

namespace clothfit {

struct SearchResult {
  FittedModel model;  ///< of the best entry
  /// The model without hypotheses, where the search changed it; else not run. The search refines
  /// it, or finds another basin in which it leaves less.
  FittedModel base;
  bool complete = true;                  ///< false where its time was up before all was tried
  bool changed_basin = false;            ///< whether a hypothesis has led it to another one
  double threshold = 0;                  ///< SearchOptions::threshold in that basin
  std::vector<AcceptedEffect> accepted;  ///< in the order of acceptance
  std::vector<Trial> refused;            ///< in the last round
  std::vector<Score> first;              ///< in the model that the search began with
  double first_share = 1;                ///< share of the frames that these are over
  std::vector<Score> last;               ///< of hypotheses that the model does not have
};

/// Adds hypotheses to a model, one after the other. Each round scores all of them (shortlist.h),
/// fits the model again with the best (expand.h) and keeps what predicts observations left out
/// (trial.h). Several entries are followed, always the cheapest (beam.h). An entry costs the
/// chi-square of its model and a price for each number more (Bayesian information criterion). Where
/// even the best hypothesis leaves a model far off, other basins are looked for (basin.h). In the
/// end hypotheses that later ones make needless are dropped (prune.h).
///
/// `base` is linearised and has directions of its errors, or it is unrefined and misfits grossly.
/// An unrefined base is refined where no hypothesis takes nearly all of what it leaves. Where
/// `progress` throws TimeIsUp, the cheapest sound entry is the result as it stands. Throws
/// StopRequested where `progress` says to stop.
SearchResult search_hypotheses(const DiagnosisSetup& setup, FittedModel base,
                               const SearchOptions& options, const ProgressCallback& progress);

}  // namespace clothfit
