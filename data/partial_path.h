#pragma once

#include <filesystem>

namespace clothfit {

/// Returns the hidden path beside `final_path` at which this process writes what it then renames:
/// `.NAME.partial-PID`, with `.gz` at the end where NAME ends so. `final_path` has a parent.
std::filesystem::path partial_path(const std::filesystem::path& final_path);

/// Removes what processes that are dead left at such paths beside `final_path`. What cannot be
/// removed does no harm.
void remove_stale_partials(const std::filesystem::path& final_path);

}  // namespace clothfit
