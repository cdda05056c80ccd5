#pragma once

#include "fit/diagnosis/fitted_model.h"

namespace clothfit {

/// Whether projected residuals look like noise. Standard scores are about normal for white ones.
struct Adequacy {
  double chi_square_per_dof = 0;        ///< with what the discretisation may explain taken out
  double noise_chi_square_per_dof = 0;  ///< against the measured noise alone
  double time_correlation = 0;          ///< of a marker with itself in its next frame
  double time_score = 0;
  double neighbour_correlation = 0;  ///< of neighbouring markers in one frame
  double neighbour_score = 0;
  /// What smooth functions of place and time take from the residual, beyond their number, of all
  /// sets of such functions that were tried the most telling.
  double smooth_share = 0;  ///< of chi-square
  double smooth_score = 0;
  /// What the model is thought to err by through its mesh and time step: the mean square, in units
  /// of the noise's. What cannot be told from it is no structure.
  double discretisation_square = 0;
  bool adequate = false;
};

/// Of a linearised model. `loss`: whether large residuals count less (Huber).
Adequacy judge_adequacy(const FittedModel& model, Loss loss);

}  // namespace clothfit
