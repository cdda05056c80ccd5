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
  /// The decrease as a share of the projected residual's excess above noise, or of the scatter of
  /// that where there is no excess.
  double share = 0;
  Columns columns;  ///< derivatives of the residuals by the amplitudes
  /// The name of amplitude `k`, and whose it is where each recording has its own.
  std::string amplitude_name(Eigen::Index k) const;
};

/// The score test [rao1948] of each hypothesis at its neutral value: derivatives there, projected,
/// against the projected residual, with amplitudes within their ranges. The scores are in the order
/// of `hypotheses`, each at its best shape; a hypothesis whose effect cannot act in this model has
/// none.
std::vector<Score> score_hypotheses(const FittedModel& model, const ModelProjection& projection,
                                    const std::vector<ShapeCandidates>& hypotheses,
                                    const ProgressCallback& progress);

}  // namespace clothfit
