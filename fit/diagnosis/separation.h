#pragma once

#include <string>
#include <vector>

#include "fit/diagnosis/fitted_model.h"
#include "fit/diagnosis/search.h"

namespace clothfit {

/// A recording of the same cloth that could be made (fit/diagnosis/candidate_recording.h). Two
/// hypotheses would be so far apart there.
struct SeparatingRecording {
  std::string what;
  double sigmas = 0;
};

/// The ways to tell an accepted effect from a hypothesis that does the same in these recordings.
struct Separation {
  Hypothesis from;
  double now = 0;  ///< how far apart they are in the recordings there are, sigmas
  std::vector<SeparatingRecording> recordings;  ///< the best of each kind, the best three first
};

/// Returns how far a hypothesis of the model is from what another one can do in its place. D are
/// the derivatives of whitened residuals by a hypothesis' amplitudes. They are projected orthogonal
/// to everything else that was fitted and to what the discretisation may err by. With a the
/// amplitudes found, beyond neutral, the distance is
///
///   | (1 - P_b) D_a a |,   P_b onto the columns of D_b,
///
/// in standard deviations of the noise. The other hypothesis may take its shape, or one half of its
/// grid's spacing beside it, and a harmonic any phase. NaN where it cannot act.
double hypothesis_distance(const FittedModel& model, const Hypothesis& hypothesis,
                           const Hypothesis& other);

/// Finds the recordings that would tell each accepted effect from each hypothesis that is alike.
/// Hypotheses that are in the model themselves are passed over. A candidate is the first recording
/// as it would be with the model found, simulated and linearised there. It counts by itself. Fitted
/// together with the recordings there are it says more, for squares of distances add up at least.
/// Candidates that do not run are left out. The result is empty where nothing is alike. Throws
/// StopRequested where `progress` says to stop.
std::vector<std::vector<Separation>> separating_recordings(
    const DiagnosisSetup& setup, const FittedModel& model,
    const std::vector<AcceptedEffect>& accepted, const ProgressCallback& progress);

}  // namespace clothfit
