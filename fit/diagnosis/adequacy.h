#pragma once

#include "fit/diagnosis/fitted_model.h"

namespace clothfit {

/// Says whether projected residuals look like noise. The standard scores are about normal for white
/// residuals.
struct Adequacy {
  double chi_square_per_dof = 0;        ///< without what the discretisation may explain
  double noise_chi_square_per_dof = 0;  ///< against the measured noise alone
  double time_correlation = 0;          ///< of a marker with itself in its next frame
  double time_score = 0;
  double neighbour_correlation = 0;  ///< of neighbouring markers in one frame
  double neighbour_score = 0;
  /// Smooth functions of place and time take this much of the residual, beyond their number. Of
  /// several sets of functions the most telling one counts.
  double smooth_share = 0;  ///< of chi-square
  double smooth_score = 0;
  /// Mean square of the error that mesh and time step are thought to make, over the noise's square.
  /// Structure that cannot be told from this error does not count.
  double discretisation_square = 0;
  /// The same of the error that was found: the expected one, and its directions by their
  /// amplitudes.
  double discretisation_found = 0;
  bool adequate = false;
};

/// Judges a linearised model. `loss` says whether large residuals count less (Huber).
Adequacy judge_adequacy(const FittedModel& model, Loss loss);

/// Return Adequacy::discretisation_square and discretisation_found of a model that was refined with
/// its discretisation.
double discretisation_expected(const FittedModel& model);
double discretisation_found(const FittedModel& model);

}  // namespace clothfit
