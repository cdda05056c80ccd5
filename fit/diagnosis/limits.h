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

/// Returns limits of hypotheses that a model does not have. `worth` is the decrease of chi-square
/// from which a hypothesis is worth a name. Where each recording has an amplitude of its own, the
/// limit is that of the recording that sees it best.
std::vector<DetectionLimit> detection_limits(const FittedModel& model, const Adequacy& structure,
                                             const std::vector<Score>& scores, double worth);

/// Chooses one amplitude of each effect, a little above its limit. Those come first that are seen
/// best for their size.
std::vector<Plant> plants_of(const std::vector<DetectionLimit>& limits);

}  // namespace clothfit
