#pragma once

#include <string>
#include <vector>

#include "apps/study/vision/chain_result.h"
#include "data/fit_result.h"

namespace clothfit {

/// Returns the value of that name; NaN where there is none.
double value_of(const std::vector<ChainNumber>& numbers, const std::string& name);

/// Returns what a fit found of the cloth: its parameters and those of effects (EFFECT.PARAMETER)
/// that were fitted, with their sigma.
std::vector<ChainNumber> fitted_parameters(const FitResult& result);

/// Compares parameters with those of another fit: |difference| / sqrt(sigma1^2 + sigma2^2). Numbers
/// without a sigma are left alone. One that only `reference` has is added without a value,
/// infinitely far away: what the fit no longer determines does not agree. One that only
/// `parameters` has stays without a comparison.
void compare_parameters(std::vector<ChainNumber>& parameters,
                        const std::vector<ChainNumber>& reference);

/// Returns the compared number that is furthest away; nullptr where none was compared.
const ChainNumber* furthest(const std::vector<ChainNumber>& numbers);

}  // namespace clothfit
