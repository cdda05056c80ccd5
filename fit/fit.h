#pragma once

#include <map>
#include <string>
#include <vector>

#include "data/progress.h"
#include "fit/interface/fit_input.h"
#include "fit/interface/fit_options.h"
#include "fit/interface/fit_report.h"

namespace clothfit {

/// Identifies the simulator that moves like the recording: evolutionary search, then refinement
/// with a growing horizon, then uncertainty and the error on held-out frames. Throws InputError
/// for a recording that cannot be fitted as it stands, and for work or memory beyond the limits
/// (fit/affordable.h).
FitReport fit(const FitInput& input, const FitOptions& options, const ProgressCallback& progress);

/// The findings of a fit elsewhere: parameters by name, and where markers are seen.
struct KnownParameters {
  std::map<std::string, double> values;  ///< others stand where a fit would begin
  std::map<std::string, double> sigma;   ///< 0 where nothing is known
  /// By the markers' names, in place of what this recording asks for
  /// (fit/observe/marker_offsets.h).
  std::vector<MarkerOffset> marker_offsets = {};
};

/// Reports what a model with known parameters leaves of a recording. Nothing is fitted. Throws
/// InputError as fit() does.
FitReport report_at(const FitInput& input, const FitOptions& options, const KnownParameters& known);

}  // namespace clothfit
