#pragma once

#include <span>
#include <vector>

#include "fit/diagnosis/fitted_model.h"
#include "fit/interface/fit_report.h"

namespace clothfit {

/// Reports of one recording. They are of the declared model, of the accepted one, and of the
/// proposed law where there is one.
struct DiagnosedRecording {
  bool held_out = false;  ///< as a whole: it took part in no fit and no decision
  FitReport before, after, with_law;
};

/// The reports of a diagnosis' recordings: those that were fitted, then those held out.
class RecordingReports {
 public:
  using Which = FitReport DiagnosedRecording::*;

  /// Refers to the inputs, which must outlive it.
  RecordingReports(std::span<const FitInput> fitted, std::span<const FitInput> held_out,
                   ProgressCallback progress);

  /// Adds reports of a model in all recordings. Of those held out, only what is their own is
  /// fitted. Throws GivenUp where the model does not run.
  void add(const DiagnosisSetup& setup, const FittedModel& model, Which which);
  void add_fitted(const DiagnosisSetup& setup, const FittedModel& model, Which which);
  void add_held_out(const DiagnosisSetup& setup, const FittedModel& model, Which which);

  /// Returns the root mean square of the markers' mean residuals in the fitted frames, per
  /// coordinate.
  double mean_residual_rms_m(Which which) const;

  std::vector<DiagnosedRecording> recordings;

 private:
  FitReport unseen(const DiagnosisSetup& setup, const FittedModel& model, FitInput input,
                   Which which) const;
  std::vector<MarkerOffset> mean_offsets(Which which) const;

  std::span<const FitInput> fitted_, held_out_;
  ProgressCallback progress_;
};

}  // namespace clothfit
