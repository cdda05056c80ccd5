#pragma once

#include <string>
#include <vector>

#include "fit/diagnosis/catalogue.h"
#include "fit/diagnosis/fitted_model.h"
#include "fit/diagnosis/hypothesis_derivatives.h"
#include "fit/diagnosis/projection.h"

namespace clothfit {

/// The linearised model's prediction of adding an effect by one mode.
struct Score {
  Hypothesis hypothesis;      ///< at the shape that is predicted to explain most
  Eigen::VectorXd amplitude;  ///< beyond neutral, in units of the parameters
  Eigen::VectorXd sigma;      ///< of each, from the noise, all else free; infinite where unseen
  double decrease = 0;        ///< of chi-square
  /// The decrease as a share of the projected residual's excess above noise. Where there is no
  /// excess, it is a share of chi-square's scatter.
  double share = 0;
  Columns columns;  ///< derivatives of the residuals by the amplitudes
  /// Of contact, which has no derivative at neutral: where a fit with it stands, and over which
  /// share of the frames (fit/diagnosis/contacts.h). Empty for all others.
  std::vector<NamedValues> fitted = {};
  double fitted_share = 1;
  /// Returns the name of amplitude `k`, and its recording where each has its own.
  std::string amplitude_name(Eigen::Index k) const;
};

/// Runs the score test [rao1948] of each hypothesis at its neutral value. Projected derivatives
/// there are held against the projected residual, with amplitudes within their ranges. The scores
/// are in the order of `hypotheses`, each at its best shape. A hypothesis whose effect cannot act
/// in this model has none. So has one whose amplitudes the model has by another mode.
std::vector<Score> score_hypotheses(const FittedModel& model, const ModelProjection& projection,
                                    const std::vector<ShapeCandidates>& hypotheses,
                                    const ProgressCallback& progress);

}  // namespace clothfit
