#pragma once

#include <span>

#include "apps/report/fit/fit_tables.h"
#include "fit/diagnosis/diagnose.h"

namespace clothfit {

/// What the score says of every law (CSV): the shape that it was best at, predicted fall of
/// chi-square, its share, predicted amplitudes.
Table candidate_table(const Diagnosis& diagnosis);
/// The most telling ones, for people.
Table short_candidate_table(const Diagnosis& diagnosis);

/// Laws with which the model was fitted again, accepted and refused, and why.
Table trial_table(const Diagnosis& diagnosis);

/// From where on every amplitude would have been seen, and what the score foresees of it.
Table limit_table(const Diagnosis& diagnosis);

/// Amplitudes that were planted on twins of the recordings, and what was found there.
Table plant_table(const Diagnosis& diagnosis);

/// "named", "not found", or what was found instead.
std::string outcome_text(const PlantOutcome& outcome);

/// How far an accepted law is from each that is alike, now and in recordings that could be made.
Table separation_table(std::span<const Separation> separations);

/// "gravity_tilt cannot be told from world_tilt (0.0 sigma; 29 sigma with: twice as long)": the
/// best recording for each law.
std::string separation_text(const Hypothesis& accepted, std::span<const Separation> separations);

/// Errors of one kind of observation of one recording, with the model as declared and as it was
/// found.
struct ErrorsBeforeAfter {
  const DiagnosedRecording* recording = nullptr;
  const ObservationErrors* before = nullptr;
  const ObservationErrors* after = nullptr;
};
std::vector<ErrorsBeforeAfter> errors_before_after(const Diagnosis& diagnosis);

/// One row for each of these: fitted and held-out error in mm or px, beside the noise and the
/// trivial predictors.
Table before_after_table(const Diagnosis& diagnosis);

/// The tests of step 1, before and after.
Table adequacy_table(const Diagnosis& diagnosis);

/// "q_x 0.05, q_y 0.21 Pa (frequency 2 Hz)": values that a fit found for a term, with sigma.
std::string found_text(const Hypothesis& term, const FitResult& result);

/// "a constant for each, 8.31 mm in the mean (rms of a coordinate)".
std::string seen_elsewhere_text(const SeenElsewhere& seen);

}  // namespace clothfit
