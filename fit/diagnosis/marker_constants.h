#pragma once

#include <optional>

#include "fit/diagnosis/analysis.h"
#include "fit/diagnosis/recording_reports.h"

namespace clothfit {

/// Constants by which markers are seen beside where the model has them
/// (fit/observe/marker_offsets.h).
struct SeenElsewhere {
  double rms_m = 0;  ///< of a coordinate; also the standard deviation of their prior
  /// Chi-square per number left out (fit/diagnosis/cross_validation.h), with them and without.
  double cross_validated = 0, without_it = 0;
};

/// Returns the constants that markers are off by, where a search beside them is worth its cost. It
/// is where no hypothesis explains all of 3D tracks, and constants take a good part of the rest on
/// blocks left out.
std::optional<SeenElsewhere> constants_to_try(const Analysis& analysis, RecordingReports& reports);

/// Searches beside such constants. The search begins with a fit of its own, or with the hypotheses
/// that `declared` accepted without them. Returns false where that does not work out, or takes no
/// good part. The constants are estimated from all blocks: that they predict blocks left out has
/// been asked before.
bool search_beside_constants(Analysis& analysis, const Analysis& declared,
                             const SeenElsewhere& constants, const ProgressCallback& progress);

}  // namespace clothfit
