#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "fit/diagnosis/adequacy.h"
#include "fit/diagnosis/criteria.h"
#include "fit/diagnosis/diagnose_options.h"
#include "fit/diagnosis/limits.h"
#include "fit/diagnosis/marker_constants.h"
#include "fit/diagnosis/planting.h"
#include "fit/diagnosis/proposed_law.h"
#include "fit/diagnosis/recording_reports.h"
#include "fit/diagnosis/residual_force.h"
#include "fit/diagnosis/separation.h"
#include "fit/interface/fit_input.h"
#include "fit/interface/fit_report.h"
#include "fit/jobs/phase_clock.h"

namespace clothfit {

enum class DiagnosisVerdict {
  adequate,          ///< nothing is missing that this recording could show
  explained,         ///< something was accepted, and the residual looks like noise
  partly_explained,  ///< something was accepted, and structure remains
  unexplained,       ///< structure, and nothing that explains it
  not_reached        ///< the diagnosis did not come to an end
};
std::string to_string(DiagnosisVerdict verdict);

struct Diagnosis {
  FitStop stop = FitStop::not_run;
  std::string message;
  DiagnosisVerdict verdict = DiagnosisVerdict::not_reached;
  DiagnosisCriteria criteria;
  /// The fitted recordings, then those held out. Each report is of the fit of all on the mesh that
  /// was analysed (report_at). For a single recording on its own mesh `before` is its own fit. That
  /// is not so where this fit only followed a coarser mesh, or where the search found another basin
  /// in which the model without any hypothesis leaves less.
  std::vector<DiagnosedRecording> recordings;
  Adequacy before, after;
  std::vector<Score> scores;  ///< in the base model, the most telling first
  int columns = 0, rows = 0;  ///< of the mesh that was analysed
  int score_frames = 0;       ///< their horizon in the first recording
  /// Constants of the markers that corrected the residual of the hypotheses. Hypotheses accepted
  /// after that were found beside the constants.
  std::optional<SeenElsewhere> seen_elsewhere;
  std::vector<AcceptedEffect> accepted;  ///< in the order of acceptance
  /// Recordings that would tell each accepted effect from each hypothesis that is alike; or empty.
  std::vector<std::vector<Separation>> separations;
  std::vector<Trial> refused;  ///< in the last round
  std::vector<DetectionLimit> limits;
  std::vector<PlantOutcome> plants;  ///< for some of the limits
  /// The outcome of a search on twins simulated with the accepted model: nothing, if all is well.
  std::optional<PlantOutcome> reinjected;
  ResidualForce residual_force;  ///< of the model as declared, over its first frames
  ProposedLaw law;               ///< for the residual, where that has structure
  double seconds = 0;
  std::vector<PhaseTime> phases;  ///< where the time went
  /// False where the search ended before it had tried all (DiagnoseOptions::budget_s, is_enough).
  /// Then neither limits nor separations nor a law were looked for.
  bool complete = true;
  bool usable() const { return is_usable(stop); }
  /// Tells whether the model found is another one than the one declared.
  bool changed() const { return seen_elsewhere.has_value() || !accepted.empty(); }
  /// Returns the separations of accepted effect `n`.
  std::span<const Separation> separation_of(size_t n) const {
    return n < separations.size() ? std::span<const Separation>(separations[n])
                                  : std::span<const Separation>();
  }
  /// Reports of the first recording, which must be there.
  const FitReport& base() const { return recordings.front().before; }
  const FitReport& found() const { return recordings.front().after; }
  const FitReport& with_law() const { return recordings.front().with_law; }
};

/// Says which effect a fitted model lacks. The declared model is fitted to recordings of one cloth,
/// and structure is looked for in the residual. The modes of registered effects are tested.
/// Those that explain the structure are added, one after the other. The outcome is judged on frames
/// and recordings held out, which take part in no decision (docs/theory/diagnosis.md). All
/// recordings share the parameters of the physics. Where each was placed, measured, or began is its
/// own, and that alone is fitted of a recording held out. Throws InputError for recordings that
/// cannot be fitted as they stand, or not together.
Diagnosis diagnose(std::span<const FitInput> fitted, std::span<const FitInput> held_out,
                   const DiagnoseOptions& options, const ProgressCallback& progress);

/// Diagnoses one recording.
Diagnosis diagnose(const FitInput& input, const DiagnoseOptions& options,
                   const ProgressCallback& progress);

}  // namespace clothfit
