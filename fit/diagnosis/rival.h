#pragma once

#include "fit/diagnosis/fitted_model.h"

namespace clothfit {

/// The change of residuals that a hypothesis makes, with everything else as it is.
struct Change {
  FittedModel without;           ///< the model without it, neither fitted nor linearised
  Eigen::VectorXd of_residuals;  ///< of all recordings; empty where the model cannot run without it
};

/// Returns what hypothesis `k` of a linearised model changes.
Change change_by(const DiagnosisSetup& setup, const FittedModel& model, size_t k);

/// Fits a model with a rival in place of its hypothesis `k`. The fit begins where the model stands,
/// at the amplitudes by which the rival changes residuals most like that hypothesis. It is not
/// usable where the rival changes them otherwise (`changes_alike`).
FittedModel with_rival(const DiagnosisSetup& setup, const FittedModel& model, size_t k,
                       const Change& change, const Hypothesis& rival, const StageOptions& stage,
                       const ProgressCallback& progress);

}  // namespace clothfit
