#pragma once

#include <vector>

#include "fit/diagnosis/law_score.h"
#include "fit/diagnosis/model_fit.h"

namespace clothfit {

/// The least fall of chi-square that counts: the square of a standard normal number, and of more of
/// them, that is as unlikely as five sigmas.
double least_fall(Eigen::Index amplitudes);

/// Of half chi-square per residual: a fit over a horizon that is not the last ends where a step
/// promises less.
inline constexpr double kRough = 1e-3;

/// Growing shares of the frames from `first` on, the last one all.
std::vector<double> shares_from(double first);

/// The model with other terms, where it stands: amplitudes that are new are neutral. What is known
/// of its derivatives is handed on, those by new parameters are of `columns` (per unit, of each
/// recording, by the last term's amplitudes) or had here.
ModelFit with_terms(const DiagnosisSetup& setup, const ModelFit& model,
                    const std::vector<Term>& terms, const Columns& columns);

/// The model with a law more, fitted: from where it stands, along the derivatives of the score, and
/// where that does not bring what was foreseen, over horizons that grow from `first_share` on,
/// which a large effect needs; the better of the two. `threshold`: of chi-square's squares, in
/// sigmas.
ModelFit fit_with_law(const DiagnosisSetup& setup, const ModelFit& model, const LawScore& score,
                      double first_share, double threshold, const ProgressCallback& progress);

}  // namespace clothfit
