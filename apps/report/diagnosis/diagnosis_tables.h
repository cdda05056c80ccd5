#pragma once

#include <span>

#include "apps/report/fit/fit_tables.h"
#include "fit/diagnosis/diagnose.h"

namespace clothfit {

/// Lists the score of every mode (CSV): its best shape, the predicted decrease of chi-square, its
/// share, and predicted amplitudes.
Table candidate_table(const Diagnosis& diagnosis);
/// Lists the most telling ones, for people.
Table short_candidate_table(const Diagnosis& diagnosis);

/// Lists modes with which the model was fitted again, accepted and refused, and why.
Table trial_table(const Diagnosis& diagnosis);

/// Returns the modes that were refused in the last round only because they change the prediction by
/// little beside the noise.
std::vector<Hypothesis> traces(const Diagnosis& diagnosis);

/// Returns the modes that were scored and not judged.
std::vector<Hypothesis> not_tried(const Diagnosis& diagnosis);

/// Lists every amplitude's detection limit, found and as the score predicts it.
Table limit_table(const Diagnosis& diagnosis);

/// Lists amplitudes planted on twins of the recordings, and the results there.
Table plant_table(const Diagnosis& diagnosis);

/// Returns "named", "not found", or the name of the effect found instead.
std::string outcome_text(const PlantOutcome& outcome);

/// Lists how far an accepted mode is from each that is alike, now and in possible recordings.
Table separation_table(std::span<const Separation> separations);

/// Writes "gravity_tilt cannot be told from world_tilt (0.0 sigma; 29 sigma with: twice as long)".
/// Each mode has its best recording.
std::string separation_text(const Hypothesis& accepted, std::span<const Separation> separations);

/// Errors of one kind of observation in one recording, with the model as declared and as found.
struct ErrorsBeforeAfter {
  const DiagnosedRecording* recording = nullptr;
  const ObservationErrors* before = nullptr;
  const ObservationErrors* after = nullptr;
};
std::vector<ErrorsBeforeAfter> errors_before_after(const Diagnosis& diagnosis);

/// Has one row for each of these: fitted and held-out error in mm or px, beside the noise and the
/// trivial predictors.
Table before_after_table(const Diagnosis& diagnosis);

/// Lists the tests of step 1, before and after.
Table adequacy_table(const Diagnosis& diagnosis);

/// Writes "hem_bottom = 4.3 ± 0.1 ratio (at hem_width 0.012)": a fit's values for a term, with
/// sigma, and its shape where that was taken for known.
std::string found_text(const Hypothesis& term, const FitResult& result);

/// Writes what a fit has found of a term in lines for the terminal: "wind (pressure): 0.250 Pa ..."
/// with its values below, or these alone where its effect has no words for them.
std::string accepted_text(const Hypothesis& term, const FitReport& found);

/// Writes " ± 0.7 % (one standard deviation)" of a term's amplitudes, of their root sum of squares.
/// Empty where none was estimated, and where a shape was fitted along.
std::string certainty_text(const Hypothesis& term, const FitResult& result);

/// Writes "Remedy: level the camera." for a term whose effect has one; nothing for others.
std::string remedy_text(const Hypothesis& term);

/// Writes "a constant for each, 8.31 mm in the mean (rms of a coordinate)".
std::string seen_elsewhere_text(const SeenElsewhere& seen);

}  // namespace clothfit
