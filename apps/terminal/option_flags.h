#pragma once

#include <string>

namespace clothfit {

/// Returns `message` as a reader of the command line knows its words. The library names options by
/// their members, FitOptions::drive_knots or JournalStart::resume; these become the flags that set
/// them, --drive-knots and --resume. `FitOptions::cost = shooting` becomes `--cost shooting`.
std::string with_flags(const std::string& message);

}  // namespace clothfit
