#pragma once

#include "apps/report/fit/fit_tables.h"
#include "apps/study/trials/undeclared_summary.h"

namespace clothfit {

/// Has a line for each trial: hidden modes, accepted ones, errors; with full digits (CSV).
Table undeclared_trials_table(const UndeclaredResult& result);

/// Has the same for people, rounded.
Table short_undeclared_trials_table(const UndeclaredResult& result);

/// Has a line for each hidden mode, with full digits (CSV).
Table undeclared_effects_table(const UndeclaredResult& result);

/// Has the same for people: rates with their bounds, and means.
Table short_undeclared_effects_table(const UndeclaredResult& result);

/// Counts hidden modes by the effect accepted first.
Table confusion_table(const UndeclaredResult& result);

}  // namespace clothfit
