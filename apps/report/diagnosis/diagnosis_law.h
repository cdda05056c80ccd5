#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "apps/report/fit/fit_tables.h"
#include "data/recording.h"
#include "fit/diagnosis/diagnose.h"

namespace clothfit {

/// These functions report the part of a diagnosis that no effect explains. They show the residual
/// force, and the law that is proposed for it.

/// Lists the quantities with which the residual force goes, the most telling first.
Table regression_table(const ResidualForce& force);

/// Lists mean and rms residual force of every marker in m/s2 (CSV).
Table residual_force_table(const ResidualForce& force, const Recording& recording);

/// Lists coefficients of the law with sigma, unit and factor.
Table law_table(const ProposedLaw& law);

/// Has one row per kind of observation: the held-out error without the law and with it.
Table law_error_table(const Diagnosis& diagnosis);

/// Shows how much each term would explain by itself: the regression of the force in its weak form.
Table term_table(const ProposedLaw& law);

/// Lists terms that were fitted, kept and refused.
Table law_trial_table(const ProposedLaw& law);

/// Draws the length of the mean and rms residual force of each marker over the flat cloth.
std::string residual_force_map_svg(const ResidualForce& force, const Recording& recording);

/// Writes the sections of the page; nothing where there is nothing to say.
std::string residual_force_html(const ResidualForce& force, const Recording& recording);
std::string proposed_law_html(const Diagnosis& diagnosis);

/// Writes the `declared` of a recording with which a fit finds this law's coefficients again. Those
/// of all other terms are 0. YAML.
std::string declaration_text(const ProposedLaw& law);

/// Writes `proposed_law` and `residual_force` of diagnosis.json; null where there is none.
nlohmann::ordered_json proposed_law_json(const Diagnosis& diagnosis);
nlohmann::ordered_json residual_force_json(const ResidualForce& force);

}  // namespace clothfit
