#pragma once

#include <string>
#include <vector>

#include "fit/diagnosis/cross_validation.h"
#include "fit/diagnosis/fitted_model.h"
#include "fit/diagnosis/score.h"

namespace clothfit {

struct ProposalOptions {
  int most_terms = 4;
  int fits = 3;                      ///< terms in one round: those predicted to explain most
  int blocks = 5;                    ///< of time, for the cross-validation
  std::vector<std::string> without;  ///< effects whose terms are not asked for
  /// Residuals beyond it count less (Huber), in sigmas; infinite for squares.
  double threshold = 1e300;
};

/// A term with which a model was fitted again.
struct TermTrial {
  Hypothesis hypothesis;
  double predicted_decrease = 0;               ///< of chi-square, by the derivatives
  double cross_validated = 0, without_it = 0;  ///< chi-square per observation left out
  std::string refused;                         ///< why it is not kept; empty: it is
};

/// A coefficient of a proposed law.
struct LawCoefficient {
  std::string effect, parameter;
  std::string unit;
  /// The formula's left side: "a", a force per mass; "p", a pressure; or "T / (k l0)".
  std::string side;
  std::string term;  ///< what it multiplies
  double value = 0;
  double sigma = 0;       ///< as fits state it (fit/uncertainty/uncertainty.h)
  bool at_bound = false;  ///< at an end of its range: more of it would do better
};

/// An empirical law for the residual of a model. It is a force per mass, a pressure, or a tension,
/// and a sum of few terms (model/effects/force_law.cpp, tension_law.cpp).
struct ProposedLaw {
  std::vector<LawCoefficient> coefficients;  ///< none: no term predicts frames left out
  std::string formula;  ///< a line for each of force per mass a, pressure p, tension T
  /// The model with the law, whose terms stand behind those that the model had. It is fitted, so
  /// that describe_model() makes of it what simulations take.
  FittedModel model;
  CrossValidation before, after;
  std::vector<Score> scores;      ///< of each term by itself, in the first round, the best first
  std::vector<TermTrial> trials;  ///< in the order in which they were fitted
  bool found() const { return !coefficients.empty(); }
};

/// Proposes a law by sparse regression over the terms of the empirical effects. The method is
/// orthogonal matching pursuit [pati1993] with refits. No force is read off accelerations, whose
/// noise would drown it. Instead the residual is regressed on what each term does to everything
/// observed, by the derivatives of the trajectory. All that the model may still move is taken out
/// of both (fit/diagnosis/projection.h).
///
/// Each round fits the model again with each of the terms that are predicted to explain most, from
/// short horizons on. It keeps the term that predicts frames left out best, where it does so better
/// than the model without it. The gain must be a tenth of what is above the noise, two per cent of
/// the noise at least, and there must be one in most of the blocks of time. In the end each term is
/// dropped without which frames left out are predicted no worse.
ProposedLaw propose_law(const DiagnosisSetup& setup, const FittedModel& model,
                        const ProposalOptions& options, const ProgressCallback& progress);

}  // namespace clothfit
