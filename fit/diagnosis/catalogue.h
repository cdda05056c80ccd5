#pragma once

#include <map>
#include <string>
#include <vector>

#include "fit/interface/fit_input.h"
#include "fit/interface/fit_options.h"
#include "fit/interface/hypothesis.h"

namespace clothfit {

/// A mode at every shape that it is tested with: hypotheses that differ in their shapes alone.
using ShapeCandidates = std::vector<Hypothesis>;

/// Returns a mode's shapes beside a model's hypotheses. Where the model has the effect by another
/// mode, the mode takes the shape there, at `values` (EFFECT.PARAMETER) where that is fitted.
ShapeCandidates at_shapes_of(const std::vector<Hypothesis>& hypotheses,
                             const std::map<std::string, double>& values,
                             const ShapeCandidates& shapes);

/// Tells whether a hypothesis is a sine of time, at any phase (Harmonic).
bool is_harmonic(const Hypothesis& hypothesis);

/// Tells whether a hypothesis' shape says where on the cloth it acts.
bool is_over_cloth(const Hypothesis& hypothesis);

/// Returns the hypothesis at shapes around its own. Each number of the shape moves either way by a
/// part of the grid's spacing, as far as its range allows.
ShapeCandidates shapes_around(const Hypothesis& hypothesis, double part);

/// Returns every mode of the empirical effects that a recording does not declare and `options` do
/// not add. A proposed law is made of such effects (fit/diagnosis/proposed_law.h), and none is
/// tested as a cause.
std::vector<Hypothesis> empirical_hypotheses(const FitInput& input, const FitOptions& options);

/// Returns the hypotheses to test on a recording: the modes of all registered effects, with
/// exceptions. Excepted are effects that it declares or that `options` add, empirical ones, and
/// those that do not apply to it. So is contact with obstacles (contacts_to_test). Frequencies run
/// from the inverse of `duration_s`. A mode of single held points has a shape of each.
std::vector<ShapeCandidates> hypotheses_to_test(const FitInput& input, const FitOptions& options,
                                                double duration_s);

/// Returns contact with each kind of obstacle whose place the pushes on the cloth can say, without
/// a shape. Excepted are those that the recording declares or that `options` add.
std::vector<Hypothesis> contacts_to_test(const FitInput& input, const FitOptions& options);

}  // namespace clothfit
