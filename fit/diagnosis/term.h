#pragma once

#include <map>
#include <string>
#include <vector>

#include "fit/interface/fit_input.h"
#include "fit/interface/fit_options.h"
#include "model/cloth/effect.h"

namespace clothfit {

/// An effect that a model has beyond what its recording declares, at work by one of its laws.
struct Term {
  std::string effect;
  std::string law;                      ///< empty where the effect has but one
  std::vector<std::string> amplitudes;  ///< parameters that are fitted
  std::map<std::string, double> shape;  ///< of parameters that say how; others are neutral
  /// How far from there a fit may go: standard deviations of a prior, from the grid's spacing.
  std::map<std::string, double> shape_sigma;
  bool fits_shape = false;  ///< whether the shape is fitted too

  std::string title() const;  ///< "nonuniform_mass (hem)"
  /// Names in the space of a fit, EFFECT.PARAMETER, of the amplitudes.
  std::vector<std::string> parameters() const;
  bool same_law(const Term& other) const { return effect == other.effect && law == other.law; }
};

/// "wind (pressure) + gravity_tilt"; "base" for none.
std::string title(const std::vector<Term>& terms);

/// The recording as if it declared these effects. Two laws of one effect are that effect with the
/// parameters of both; a shape that they share is the last one's, and is fitted if either fits it.
FitInput with_terms(FitInput input, const std::vector<Term>& terms);

/// An effect's description, of motion or of the measurement. Throws InputError for an unknown name.
EffectDescription describe_effect(const std::string& name);

/// One law with every shape that it is tested with: the same term but for its shape.
using LawShapes = std::vector<Term>;

/// Whether two laws are of one effect and a number of their shapes is the same.
bool share_shape(const Term& one, const Term& other);

/// A law's shapes beside a model: an effect that the model has by another law has the shape that it
/// has there, at `values` (EFFECT.PARAMETER) where that is fitted.
LawShapes at_shapes_of(const std::vector<Term>& terms, const std::map<std::string, double>& values,
                       const LawShapes& law);

/// Whether a law is a sine of time, at any phase (Harmonic).
bool is_harmonic(const Term& law);

/// Whether a law's shape says where on the cloth it acts.
bool is_over_cloth(const Term& law);

/// The term at shapes around its own: each number of it moved either way by a part of the grid's
/// spacing, as far as its range allows.
LawShapes shapes_around(const Term& term, double part);

/// Whether an effect says what a force looks like and names no cause for it: a law that a diagnosis
/// proposes is made of its laws (fit/diagnosis/proposed_law.h), and none is tested as a cause.
bool is_empirical(const std::string& effect);

/// Every law of the empirical effects that a recording does not declare and `options` do not add.
std::vector<Term> empirical_laws(const FitInput& input, const FitOptions& options);

/// Every law that a recording can be asked for: those of all registered effects but the ones that
/// it declares itself or that `options` add, empirical ones, those that do not apply to it, and
/// those that its geometry must be guessed for (contact with an obstacle nobody has described).
/// Frequencies run from the inverse of `duration_s`.
std::vector<LawShapes> laws_to_test(const FitInput& input, const FitOptions& options,
                                    double duration_s);

}  // namespace clothfit
