#pragma once

#include "fit/diagnosis/adequacy.h"
#include "fit/diagnosis/fitted_model.h"

namespace clothfit {

/// Returns how many standard deviations the last hypothesis' amplitudes stand from neutral. Several
/// amplitudes count together as one number that is as unlikely. `structure` describes the model's
/// residuals. Where they depend on each other, their sums scatter more than those of noise. The
/// variance is then that of noise times chi-square per degree of freedom. In time and both ways
/// along the cloth it grows by (1 + rho) / (1 - rho), rho the correlation of neighbours, as of a
/// process that forgets geometrically. Where the cost is rough, as of cloth that folds and
/// unfolds, derivatives are far steeper than the residuals' trend over two per cent. There the
/// trend counts (`trend_of`, fit/uncertainty/uncertainty.h). `threshold` is Huber's.
double clear_of_neutral(const FittedModel& model, const Adequacy& structure, double threshold);

/// Returns the same from the decrease of chi-square that a hypothesis brings. A touch has no
/// small amplitude, and its stiffness is hardly known where it is hard; so it is judged by this.
double clear_by(double decrease, Eigen::Index numbers, const Adequacy& structure);

/// Predicts how much chi-square rises where the last hypothesis is dropped and all else follows.
/// The prediction is of second order where the model stands.
double rise_without_last(const FittedModel& model, double threshold);

/// Returns standard deviations of each recording's parameters, by name and in their units. Errors
/// have the structure that is given. Where the cost is rough, the trend counts.
std::vector<NamedValues> sigma_of(const FittedModel& model, const Adequacy& structure,
                                  double threshold);

/// Returns the median roughness of a linearised model's derivatives over the physics' parameters
/// (fit/uncertainty/uncertainty.h). The standard deviations of effects that the model lacks are
/// larger than derivatives say by the same factor. It is 1 where the cost is a smooth basin.
double typical_roughness(const FittedModel& model);

}  // namespace clothfit
