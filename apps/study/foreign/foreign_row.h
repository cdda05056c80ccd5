#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "apps/study/foreign/judgement.h"

namespace clothfit {

/// The diagnosis of one recording. Nothing in it knows the truth.
struct ForeignDiagnosis {
  std::string reason;  ///< why there is none; empty where there is one
  DiagnosisVerdict verdict = DiagnosisVerdict::not_reached;
  bool complete = true;            ///< false where its budget was spent before all was tried
  std::vector<NamedEffect> named;  ///< in the order of acceptance
  std::string unit;                ///< of the errors: "m" or "px"
  /// Error of the model found on held-out frames, and the noise of the observations. Both are root
  /// mean squares of the distance; NaN where nothing is held out.
  double held_out_rms = std::numeric_limits<double>::quiet_NaN();
  double noise = std::numeric_limits<double>::quiet_NaN();
  double seconds = 0;  ///< with the steps before, such as tracking

  bool reached() const { return reason.empty(); }
};

/// A diagnosis beside the truth.
struct ForeignRow {
  std::string recording;
  std::optional<ForeignTruth> truth;  ///< none where it cannot be read
  ForeignDiagnosis diagnosis;

  bool judged() const { return diagnosis.reached() && truth.has_value(); }
  /// Judges the diagnosis, which must be there as the truth must.
  Judgement judgement() const { return judge(*truth, diagnosis.verdict, diagnosis.named); }
  bool right() const { return judged() && judgement().right(); }
  /// Returns held_out_rms / sqrt(noise^2 + floor^2); NaN without a floor or a held-out error.
  double error_over_floor() const;
};

/// Write all of a diagnosis as one line for a journal, and read it back.
std::string payload_of(const ForeignDiagnosis& diagnosis);
ForeignDiagnosis foreign_diagnosis_of(const std::string& payload);

}  // namespace clothfit
