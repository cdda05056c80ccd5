#pragma once

#include "fit/diagnosis/adequacy.h"
#include "fit/diagnosis/model_fit.h"

namespace clothfit {

/// How many standard deviations the last term's amplitudes of a fitted model stand from neutral,
/// several together as one number that is as unlikely. `structure`: what the model's residuals are
/// like. Where they depend on each other their sums scatter more than those of noise would: the
/// variance is that of noise times chi-square per degree of freedom and, in time and both ways
/// along the cloth, the (1 + rho) / (1 - rho) of a process that forgets geometrically, rho the
/// correlation of neighbours. `threshold` is Huber's.
double clear_of_neutral(const ModelFit& model, const Adequacy& structure, double threshold);

/// Standard deviations of each recording's parameters in their units, by name, with errors of that
/// structure.
std::vector<NamedValues> sigma_of(const ModelFit& model, const Adequacy& structure,
                                  double threshold);

}  // namespace clothfit
