#pragma once

#include "apps/report/fit/fit_tables.h"
#include "apps/study/trials/undeclared_summary.h"

namespace clothfit {

/// A line for each trial: what was hidden, what was accepted, errors; with full digits (CSV).
Table undeclared_trials_table(const UndeclaredResult& result);

/// The same for people, rounded.
Table short_undeclared_trials_table(const UndeclaredResult& result);

/// A line for each hidden law, with full digits (CSV).
Table undeclared_effects_table(const UndeclaredResult& result);

/// The same for people: rates with their bounds, and means.
Table short_undeclared_effects_table(const UndeclaredResult& result);

/// Hidden laws by the effect accepted first.
Table confusion_table(const UndeclaredResult& result);

}  // namespace clothfit
