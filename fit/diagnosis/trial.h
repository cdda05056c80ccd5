#pragma once

#include <limits>
#include <string>
#include <vector>

#include "fit/diagnosis/cross_validation.h"
#include "fit/diagnosis/fitted_model.h"
#include "fit/diagnosis/score.h"

namespace clothfit {

struct SearchContext;

/// One condition that was asked of a hypothesis.
struct Criterion {
  std::string name;
  double measured = 0, threshold = 0;  ///< NaN where it is no number
  bool passed = false;
  std::string refusal;  ///< said where it did not pass
};

/// The findings on a hypothesis with which a model was fitted again. A number is NaN where the
/// hypothesis was refused before it was asked.
struct Trial {
  static constexpr double kNotAsked = std::numeric_limits<double>::quiet_NaN();
  Hypothesis hypothesis;
  double predicted_decrease = 0;                               ///< of chi-square, by the score
  double decrease = kNotAsked;                                 ///< by the fit
  double cross_validated = kNotAsked, without_it = kNotAsked;  ///< chi-square per one left out
  double best_trivial = kNotAsked;      ///< the same of the model without it, corrected
  double clear_of_neutral = kNotAsked;  ///< standard deviations, clustered
  std::vector<Criterion> criteria;      ///< in the order in which they were asked
  /// Corrections without physics did as well as the hypothesis alone. It is followed all the same,
  /// for what it does together with hypotheses accepted after it. With these it must beat the
  /// corrections.
  bool on_credit = false;

  bool passed() const;          ///< every criterion
  bool is_trace() const;        ///< refused only because it changes the prediction too little
  std::string refusal() const;  ///< of the criterion that it did not pass; else empty
};

/// One effect that was accepted, with what speaks for it.
struct AcceptedEffect {
  Trial trial;
  std::vector<Hypothesis> alike;  ///< hypotheses that these recordings cannot tell from it
  std::vector<Trial> refused;     ///< others that were fitted in its place
};

/// A model without a hypothesis, and with it.
struct Compared {
  const FittedModel& without;
  const CrossValidation& without_left_out;  ///< with free forces
  const Score& score;
  const FittedModel& with;
  /// The score is that of another basin or mesh than those of the model without the hypothesis.
  bool scored_elsewhere = false;
};

/// Asks one criterion after the other, the cheap ones first, until one is not passed.
Trial try_hypothesis(const SearchContext& search, const Compared& models);

/// Returns how much a hypothesis' amplitudes change a model's prediction, with everything else as
/// it is: rms in units of the noise.
double change_of_prediction(const FittedModel& model, const Hypothesis& hypothesis);

/// Cross-validates a model. `forces_mesh` is that of free forces, where these are asked for.
CrossValidation left_out_of(const SearchContext& search, const FittedModel& model,
                            const DiagnosisSetup* forces_mesh = nullptr);

/// Returns chi-square per number left out of a model that is corrected without physics.
double without_physics(const CrossValidation& of);

}  // namespace clothfit
