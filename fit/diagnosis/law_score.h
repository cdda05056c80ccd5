#pragma once

#include <string>
#include <vector>

#include "fit/diagnosis/law_derivatives.h"
#include "fit/diagnosis/model_fit.h"
#include "fit/diagnosis/projection.h"

namespace clothfit {

/// What the linearised model foresees of adding an effect by one law.
struct LawScore {
  Term term;               ///< at the shape that foresees most
  Eigen::VectorXd amount;  ///< of its amplitudes beyond neutral, in their units
  Eigen::VectorXd sigma;   ///< of each from the noise, all else free; infinite where unseen
  double fall = 0;         ///< of chi-square
  /// Of it in all that the projected residual has above its noise, or above that one's scatter.
  double share = 0;
  Columns columns;  ///< derivatives of the residuals by the amplitudes
  /// Of amount `k`: the amplitude, and whose it is where each recording has its own.
  std::string amount_name(Eigen::Index k) const;
};

/// The score test [rao1948] of each law at its neutral value: derivatives there, projected, against
/// the projected residual; amplitudes within their ranges. In the order of `laws`; a law whose
/// effect cannot act in this model is left out.
std::vector<LawScore> score_laws(const ModelFit& model, const ModelProjection& projection,
                                 const std::vector<LawShapes>& laws,
                                 const ProgressCallback& progress);

}  // namespace clothfit
