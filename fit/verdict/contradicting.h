#pragma once

#include "data/markers.h"
#include "fit/interface/fit_report.h"

namespace clothfit {

/// Names the markers of a report that contradict all others: over a stretch of their frames they
/// lie so far off the model that a robust loss hardly weighs them, and many times as far as the
/// other markers do. Tracks were exchanged, or follow something else. Where there are any, errors
/// without them are added. Where many lie off, or a marker's neighbours with it, the model does,
/// and none is named. The errors are also without single observations that jump away from a track
/// and back.
void name_contradicting(const MarkerSet& markers, FitReport& report);

}  // namespace clothfit
