#pragma once

#include <string>
#include <vector>

#include "fit/diagnosis/fitted_model.h"
#include "fit/diagnosis/search.h"

namespace clothfit {

/// A recording of the same cloth that could be made (fit/diagnosis/candidate_recording.h), and how
/// far two laws would be apart there.
struct SeparatingRecording {
  std::string what;
  double sigmas = 0;
};

/// What it takes to tell an accepted law from another one that does the same in these recordings.
struct Separation {
  Hypothesis from;
  double now = 0;  ///< how far apart they are in the recordings there are, sigmas
  std::vector<SeparatingRecording> recordings;  ///< the best of each kind, the best three first
};

/// How far a law of the model, at the amplitudes found, is from what another law can do in its
/// place: with D the derivatives of whitened residuals by a law's amplitudes, projected orthogonal
/// to everything else that was fitted and to what the discretisation may err by, and a the
/// amplitudes beyond neutral,
///
///   | (1 - P_b) D_a a |,   P_b onto the columns of D_b,
///
/// in standard deviations of the noise. The other law may take its shape, or one half of its
/// grid's spacing beside it, and a harmonic any phase. NaN where it cannot act.
double hypothesis_distance(const FittedModel& model, const Hypothesis& law,
                           const Hypothesis& other);

/// Of each accepted effect, the recordings that would tell it from each law that is alike and not
/// in the model itself. A candidate is the first recording as it would be with the model found,
/// simulated and linearised there; it counts by itself. (Fitted together with those there are it
/// says more: squares of distances add up at least.) Candidates that do not run are left out.
/// Empty where nothing is alike. Throws StopRequested where `progress` says to stop.
std::vector<std::vector<Separation>> separating_recordings(
    const DiagnosisSetup& setup, const FittedModel& model,
    const std::vector<AcceptedEffect>& accepted, const ProgressCallback& progress);

}  // namespace clothfit
