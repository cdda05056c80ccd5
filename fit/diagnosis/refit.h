#pragma once

#include <vector>

#include "fit/diagnosis/fitted_model.h"
#include "fit/diagnosis/score.h"

namespace clothfit {

/// The model with other hypotheses, where it stands. Amplitudes that are new are neutral. What is
/// known of its derivatives is handed on. Those by new parameters are `columns` (per unit, of each
/// recording, by the last hypothesis' amplitudes), or are computed here.
FittedModel with_hypotheses(const DiagnosisSetup& setup, const FittedModel& model,
                            const std::vector<Hypothesis>& hypotheses, const Columns& columns);

/// The model with each hypothesis, fitted. `threshold`: Huber's, in sigmas.
///
/// Where the first share is 1, a fit begins where the model stands, along the derivatives of the
/// score. It stays unrefined where it gains what was predicted and less than half as much as the
/// best. Where it does not gain that, it is tried over growing horizons too.
///
/// A large effect needs these from the start: fits race over horizons that grow from `first_share`
/// on, from where `early` stands, the model fitted over the first of them and less biased. After
/// each horizon those fall out, and fail, that leave far more than the best; over few frames the
/// wrong hypotheses show first. One that ends above the model without it is fitted from where that
/// stands.
std::vector<FittedModel> fit_with_hypotheses(const DiagnosisSetup& setup, const FittedModel& model,
                                             const FittedModel& early,
                                             const std::vector<const Score*>& scores,
                                             double first_share, double threshold,
                                             const ProgressCallback& progress);

/// Models fitted on another mesh (fit_on_mesh), side by side. After each horizon those fall out,
/// and fail, that leave far more than the best one.
std::vector<FittedModel> race_on_mesh(const DiagnosisSetup& other,
                                      const std::vector<FittedModel>& models, double threshold,
                                      const ProgressCallback& progress);

/// The model with these hypotheses identified as if nothing were known of its parameters
/// (fit/fit.h), linearised: from the first recording, and from there of all of them. Not usable
/// where that leads nowhere, nor where a recording begins in motion.
FittedModel identified_from_scratch(const DiagnosisSetup& setup,
                                    const std::vector<Hypothesis>& hypotheses,
                                    const ProgressCallback& progress);

}  // namespace clothfit
