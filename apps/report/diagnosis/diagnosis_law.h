#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "apps/report/fit/fit_tables.h"
#include "data/recording.h"
#include "fit/diagnosis/diagnose.h"

namespace clothfit {

/// The part of a diagnosis about what no effect explains: the residual force, and the law that is
/// proposed for it.

/// What the residual force goes with, the most telling first.
Table regression_table(const ResidualForce& force);

/// Mean and rms residual force of every marker in m/s2 (CSV).
Table residual_force_table(const ResidualForce& force, const Recording& recording);

/// Coefficients of the law with sigma, unit and what they multiply.
Table law_table(const ProposedLaw& law);

/// One row per kind of observation: the held-out error without the law and with it.
Table law_error_table(const Diagnosis& diagnosis);

/// What each term would explain by itself: the regression of the force in its weak form.
Table term_table(const ProposedLaw& law);

/// Terms that were fitted, kept and refused.
Table law_trial_table(const ProposedLaw& law);

/// Length of the mean and rms residual force of each marker over the flat cloth.
std::string residual_force_map_svg(const ResidualForce& force, const Recording& recording);

/// Sections of the page; nothing where there is nothing to say.
std::string residual_force_html(const ResidualForce& force, const Recording& recording);
std::string proposed_law_html(const Diagnosis& diagnosis);

/// What a recording's `declared` has to say so that a fit finds this law's coefficients again:
/// those of all other terms are 0. YAML.
std::string declaration_text(const ProposedLaw& law);

/// `proposed_law` and `residual_force` of diagnosis.json; null where there is none.
nlohmann::ordered_json proposed_law_json(const Diagnosis& diagnosis);
nlohmann::ordered_json residual_force_json(const ResidualForce& force);

}  // namespace clothfit
