#pragma once

#include <vector>

#include "fit/diagnosis/law_score.h"
#include "fit/diagnosis/model_fit.h"

namespace clothfit {

/// The least fall of chi-square that counts: the square of a standard normal number, and of more of
/// them, that is as unlikely as five sigmas.
double least_fall(Eigen::Index amplitudes);

/// The model with other terms, where it stands: amplitudes that are new are neutral. What is known
/// of its derivatives is handed on, those by new parameters are of `columns` (per unit, of each
/// recording, by the last term's amplitudes) or had here.
ModelFit with_terms(const DiagnosisSetup& setup, const ModelFit& model,
                    const std::vector<Term>& terms, const Columns& columns);

/// Of each law, the model with it, fitted: where the first share is 1, from where the model stands,
/// along the derivatives of the score; roughly (ModelFit::rough) where it gains what was foreseen
/// and less than half as much as the best. Where that does not bring what was foreseen, and else,
/// over horizons that grow from `first_share` on, which a large effect needs: from where `early`
/// stands, the model fitted over the first of them and not biased as much. Side by side then: after
/// each horizon those fall out, and are not usable, that leave far more than the best one; over few
/// frames the wrong laws show first. One that ends above the model without it is fitted from where
/// that stands. `threshold`: of chi-square's squares, in sigmas. `progress` is asked by several
/// threads at once (data/shared_progress.h).
std::vector<ModelFit> fit_with_laws(const DiagnosisSetup& setup, const ModelFit& model,
                                    const ModelFit& early,
                                    const std::vector<const LawScore*>& scores, double first_share,
                                    double threshold, const ProgressCallback& progress);

/// Models fitted on another mesh (fit_on_mesh), side by side: after each horizon those fall out,
/// and are not usable, that leave far more than the best one.
std::vector<ModelFit> race_on_mesh(const DiagnosisSetup& other, const std::vector<ModelFit>& models,
                                   double threshold, const ProgressCallback& progress);

/// The model with these laws identified from scratch, as if nothing were known of its parameters
/// (fit/fit.h), linearised: from the first recording, and then, from there, of all of them. Not
/// usable where that leads nowhere, nor where a recording begins in motion.
ModelFit fitted_anew(const DiagnosisSetup& setup, const std::vector<Term>& terms,
                     const ProgressCallback& progress);

}  // namespace clothfit
