#pragma once

#include "apps/report/fit/fit_tables.h"
#include "apps/study/trials/recover.h"

namespace clothfit {

/// Has a line for each parameter: bias, spread, coverage.
Table recovery_table(const RecoverResult& result);

/// Lists counts beside every rate: trials, failures, unconverged fits, wrong ones.
Table recovery_counts(const RecoverResult& result);

/// Has a line for each parameter of each trial, with full digits.
Table recovery_trials_table(const RecoverResult& result);

/// Compares the tracker's places of markers with the true ones.
Table tracker_table(const TrackerErrors& tracker);

/// Lists the tracker's rejections, by reason; no rows where there are none.
Table tracker_rejections(const TrackerErrors& tracker);

/// Has a line for each trial with pictures, with full digits.
Table tracker_trials_table(const RecoverResult& result);

}  // namespace clothfit
