#pragma once

#include <string>
#include <vector>

#include "fit/diagnosis/adequacy.h"
#include "fit/diagnosis/planting.h"
#include "fit/diagnosis/score.h"

namespace clothfit {

/// The amplitudes from which on a recording would show a hypothesis.
struct DetectionLimit {
  Hypothesis hypothesis;  ///< at the shape at which it was seen best
  std::vector<std::string> parameter;
  std::vector<std::string> unit;
  /// Each amplitude beyond neutral at which it is clear of neutral and worth a name (worth.h).
  Eigen::VectorXd limit;
  Eigen::VectorXd found;  ///< the amplitude that the score predicts
  double decrease = 0;    ///< of chi-square, predicted
};

/// Limits of hypotheses that a model does not have. `worth`: the decrease of chi-square from which
/// one is worth a name. An amplitude that each recording has for itself has the limit of the
/// recording that sees it best.
std::vector<DetectionLimit> detection_limits(const FittedModel& model, const Adequacy& structure,
                                             const std::vector<Score>& scores, double worth);

/// One amplitude of each effect, a little above its limit, those first that are seen best for their
/// size.
std::vector<Plant> plants_of(const std::vector<DetectionLimit>& limits);

}  // namespace clothfit
