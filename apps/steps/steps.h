#pragma once

#include <filesystem>

#include "calib/boards/calibrate.h"
#include "data/finding.h"
#include "data/progress.h"
#include "data/recording.h"
#include "fit/interface/fit_input.h"
#include "fit/interface/fit_options.h"
#include "vision/track/track.h"

namespace clothfit {

/// Options of the steps that come before a fit.
struct StepOptions {
  CalibrateOptions calibrate;
  TrackOptions track;
};

/// Returns the kind that a fit of `kind` will look at: 3D tracks where there are any, unless told
/// otherwise.
ObservationKind resolve_observations(const Recording& recording, ObservationKind kind);

/// A recording that lacks nothing for a fit.
struct CompletedRecording {
  Recording recording;  ///< the given one when nothing was lacking
  Findings footage;     ///< what is to be said of pictures that were tracked
};

/// Runs the steps that a recording still lacks for a fit of `kind`. Each goes into a complete
/// recording of its own: `steps`/calibrated, `steps`/tracked. Throws InputError, NoResult,
/// Cancelled.
CompletedRecording complete_recording(const Recording& recording, ObservationKind kind,
                                      const StepOptions& options,
                                      const std::filesystem::path& steps,
                                      const ProgressCallback& progress);

/// Reads the input of a fit of `kind`. Throws InputError, also where there is nothing to look at or
/// a camera has no pose.
FitInput read_fit_input(const Recording& recording, ObservationKind kind);

}  // namespace clothfit
