#pragma once

#include <vector>

#include "fit/diagnosis/fitted_model.h"
#include "fit/diagnosis/score.h"

namespace clothfit {

struct SearchContext;

/// The hypotheses that an entry may be extended by.
struct Shortlist {
  /// The entry's model on the coarse mesh, where that mesh does for the round; otherwise not run.
  /// It leaves what the entry's model leaves: the difference of the two meshes where the entry
  /// stands is taken for constant.
  FittedModel coarse;
  double share = 1;           ///< the shortest horizon, as a share of the fitted frames
  FittedModel early;          ///< the model fitted over that
  std::vector<Score> scores;  ///< of all hypotheses there
  /// Scores of the best of them, averaged over horizons. They have columns where the only horizon
  /// is all frames.
  std::vector<Score> best;

  /// Tells whether scores are of all frames on the analysed mesh.
  bool is_of_whole_run() const { return share == 1 && !coarse.usable(); }
  /// Returns all scores, averaged ones where there are any.
  std::vector<Score> merged() const;
};

/// Returns the scores without their columns.
std::vector<Score> without_columns(std::vector<Score> scores);

/// Scores every hypothesis that a model does not have. A fit over all frames of a model that lacks
/// much is biased, and its scores with it. So such a model is fitted over a few frames too, and
/// scored from the shortest horizon on at which something is missing, on the coarse mesh where
/// there is one.
Shortlist make_shortlist(const SearchContext& search, const FittedModel& model);

/// Scores hypotheses, each at its best shape, over the frames and on the mesh of `model`.
std::vector<Score> score_at_best_shapes(const SearchContext& search, const DiagnosisSetup& setup,
                                        const FittedModel& model,
                                        std::vector<ShapeCandidates> hypotheses);

}  // namespace clothfit
