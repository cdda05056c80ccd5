#pragma once

#include "fit/diagnosis/fitted_model.h"

namespace clothfit {

/// Returns the least decrease of chi-square that counts. It is the square of a standard normal
/// number, or of several, that is as unlikely as five sigma.
double least_decrease(Eigen::Index amplitudes);

/// Returns chi-square above what noise makes, less twice its standard deviation; 0 at least.
double sure_excess(const FittedModel& model, double threshold);

/// Returns the decrease of chi-square from which a hypothesis is worth a name, however sure it is.
/// Four things bound it. Noise is known to three tenths of a per cent at best. A model whose
/// numerics err leaves structure that many hypotheses follow a little, so a third of the sure
/// excess is asked. Where much is missing that no single hypothesis explains, a twentieth of
/// chi-square and a quarter of the noise are enough. The form of an accepted effect is known to
/// five per cent, so what its error may leave is worth no name beside hypotheses that explain much
/// (`explained`, of chi-square).
double worth_naming(const FittedModel& model, double threshold, double explained = 0);

/// Returns the price of a model's amplitudes and shapes (Bayesian information criterion). The data
/// choose a shape too, of a grid or by a fit.
double price_of_amplitudes(const FittedModel& model);

}  // namespace clothfit
