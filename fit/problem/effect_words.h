#pragma once

#include <string>

#include "fit/interface/fit_report.h"
#include "fit/interface/hypothesis.h"
#include "model/cloth/fitted_effect.h"

namespace clothfit {

/// Returns a hypothesis' effect with the values that a fit has found or was given, and its cloth.
FittedEffect fitted_effect(const Hypothesis& hypothesis, const FitReport& report);

/// Tells in quantities of people what a fit has found of a hypothesis: "6.43 g along the bottom
/// edge". Empty where its effect has no such words (EffectDescription::in_words), where it does
/// nothing, or where the report has no model.
std::string words_of(const Hypothesis& hypothesis, const FitReport& report);

}  // namespace clothfit
