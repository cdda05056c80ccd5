#pragma once

#include <map>
#include <string>
#include <vector>

#include "fit/interface/fit_input.h"
#include "fit/interface/fit_options.h"
#include "fit/interface/hypothesis.h"

namespace clothfit {

/// One law with every shape that it is tested with: the same term but for its shape.
using ShapeCandidates = std::vector<Hypothesis>;

/// A law's shapes beside a model: an effect that the model has by another law has the shape that it
/// has there, at `values` (EFFECT.PARAMETER) where that is fitted.
ShapeCandidates at_shapes_of(const std::vector<Hypothesis>& terms,
                             const std::map<std::string, double>& values,
                             const ShapeCandidates& law);

/// Whether a law is a sine of time, at any phase (Harmonic).
bool is_harmonic(const Hypothesis& law);

/// Whether a law's shape says where on the cloth it acts.
bool is_over_cloth(const Hypothesis& law);

/// The term at shapes around its own: each number of it moved either way by a part of the grid's
/// spacing, as far as its range allows.
ShapeCandidates shapes_around(const Hypothesis& term, double part);

/// Whether an effect says what a force looks like and names no cause for it: a law that a diagnosis
/// proposes is made of its laws (fit/diagnosis/proposed_law.h), and none is tested as a cause.
bool is_empirical(const std::string& effect);

/// Every law of the empirical effects that a recording does not declare and `options` do not add.
std::vector<Hypothesis> empirical_hypotheses(const FitInput& input, const FitOptions& options);

/// Every law that a recording can be asked for: those of all registered effects but the ones that
/// it declares itself or that `options` add, empirical ones, those that do not apply to it, and
/// those that its geometry must be guessed for (contact with an obstacle nobody has described).
/// Frequencies run from the inverse of `duration_s`.
std::vector<ShapeCandidates> hypotheses_to_test(const FitInput& input, const FitOptions& options,
                                                double duration_s);

}  // namespace clothfit
