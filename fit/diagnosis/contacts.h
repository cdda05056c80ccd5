#pragma once

#include <vector>

#include "fit/diagnosis/fitted_model.h"
#include "fit/diagnosis/score.h"

namespace clothfit {

struct SearchContext;

/// Scores contact with obstacles that nobody has described. An obstacle pushes the markers that it
/// touches along its normal, and its place follows from where and which way: the normals of a ball
/// meet in its centre, those of a plane are alike. Such places are tried by runs of the model with
/// a hard obstacle there. The best of them are fitted, and scored by what the fit leaves less.
///
/// `at` is the model over a horizon at which something is missing. `before` is the model over the
/// longest horizon at which nothing was, or a model that is not usable. It says better where the
/// cloth would have gone. `contacts` are the hypotheses to score, without shapes. There is a score
/// of each that leaves less, with its shape free to be fitted further. Recordings without 3D tracks
/// say nothing, and neither does one in which nothing moves against the model by itself.
std::vector<Score> score_contacts(const SearchContext& search, const DiagnosisSetup& mesh,
                                  const FittedModel& before, const FittedModel& at,
                                  const std::vector<Hypothesis>& contacts);

}  // namespace clothfit
