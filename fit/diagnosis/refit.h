#pragma once

#include <vector>

#include "fit/diagnosis/fitted_model.h"
#include "fit/diagnosis/score.h"

namespace clothfit {

/// Returns the model with other hypotheses, where it stands. New amplitudes are neutral. What is
/// known of its derivatives is handed on. Those by new parameters are `columns`, or are computed
/// here where these are empty. `columns` are per unit, of each recording, by the last hypothesis'
/// amplitudes.
FittedModel with_hypotheses(const DiagnosisSetup& setup, const FittedModel& model,
                            const std::vector<Hypothesis>& hypotheses, const Columns& columns);

/// Fits the model with each hypothesis. `threshold` is Huber's, in sigmas.
///
/// Where the first share is 1, a fit begins where the model stands, along the derivatives of the
/// score. It stays unrefined where it gains what was predicted and less than half as much as the
/// best. Where it gains less than predicted, it is tried over growing horizons too.
///
/// A large effect needs growing horizons from the start. Fits race over horizons that grow from
/// `first_share` on. They begin where `early` stands, the model fitted over the first horizon,
/// which is less biased. After each horizon fits that leave far more than the best fall out and
/// fail, for over few frames the wrong hypotheses show first. A fit that ends above the model
/// without the hypothesis is repeated from where that model stands.
std::vector<FittedModel> fit_with_hypotheses(const DiagnosisSetup& setup, const FittedModel& model,
                                             const FittedModel& early,
                                             const std::vector<const Score*>& scores,
                                             double first_share, double threshold,
                                             const ProgressCallback& progress);

/// Identifies the model with these hypotheses as if nothing were known of its parameters
/// (fit/fit.h). It is fitted to the first recording, from there to all of them, and linearised. It
/// is not usable where that leads nowhere, nor where a recording begins in motion.
FittedModel identified_from_scratch(const DiagnosisSetup& setup,
                                    const std::vector<Hypothesis>& hypotheses,
                                    const ProgressCallback& progress);

}  // namespace clothfit
