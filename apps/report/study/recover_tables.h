#pragma once

#include "apps/report/fit/fit_tables.h"
#include "apps/study/trials/recover.h"

namespace clothfit {

/// A line for each parameter: bias, spread, coverage.
Table recovery_table(const RecoverResult& result);

/// Counts beside every rate: trials, failures, unconverged fits, wrong ones.
Table recovery_counts(const RecoverResult& result);

/// A line for each parameter of each trial, with full digits.
Table recovery_trials_table(const RecoverResult& result);

/// What the tracker said of the places of markers, against where they were.
Table tracker_table(const TrackerErrors& tracker);

/// What it rejected, by reason; no rows where that is nothing.
Table tracker_rejections(const TrackerErrors& tracker);

/// A line for each trial with pictures, with full digits.
Table tracker_trials_table(const RecoverResult& result);

}  // namespace clothfit
