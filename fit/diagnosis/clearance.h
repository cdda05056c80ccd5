#pragma once

#include "fit/diagnosis/adequacy.h"
#include "fit/diagnosis/fitted_model.h"

namespace clothfit {

/// How many standard deviations the last term's amplitudes of a fitted model stand from neutral,
/// several together as one number that is as unlikely. `structure`: what the model's residuals are
/// like. Where they depend on each other their sums scatter more than those of noise would: the
/// variance is that of noise times chi-square per degree of freedom and, in time and both ways
/// along the cloth, the (1 + rho) / (1 - rho) of a process that forgets geometrically, rho the
/// correlation of neighbours. Where the cost is rough, as of cloth that folds and unfolds, and
/// derivatives are far steeper than the residuals' trend over two per cent, the trend counts
/// (`trend_of`, fit/uncertainty/uncertainty.h). `threshold` is Huber's.
double clear_of_neutral(const FittedModel& model, const Adequacy& structure, double threshold);

/// By how much chi-square is foreseen to rise where the last term is dropped and all else follows,
/// to second order where the model stands.
double rise_without_last(const FittedModel& model, double threshold);

/// Standard deviations of each recording's parameters in their units, by name, with errors of that
/// structure, by the trend where the cost is rough.
std::vector<NamedValues> sigma_of(const FittedModel& model, const Adequacy& structure,
                                  double threshold);

/// Roughness of a linearised model's derivatives (fit/uncertainty/uncertainty.h), the median over
/// the physics' parameters: by so much the standard deviations of effects that are not in it, too,
/// are larger than derivatives say. 1 where the cost is a valley.
double typical_roughness(const FittedModel& model);

}  // namespace clothfit
