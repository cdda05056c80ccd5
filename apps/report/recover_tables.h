#pragma once

#include "apps/report/fit_tables.h"
#include "apps/study/recover.h"

namespace clothfit {

/// A line for each parameter: bias, spread, coverage.
Table recovery_table(const RecoverResult& result);

/// Counts beside every rate: trials, failures, unconverged fits, wrong ones.
Table recovery_counts(const RecoverResult& result);

/// A line for each parameter of each trial, with full digits.
Table recovery_trials_table(const RecoverResult& result);

}  // namespace clothfit
