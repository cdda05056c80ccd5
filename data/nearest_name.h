#pragma once

#include <string>
#include <vector>

namespace clothfit {

/// Lists the known names, the nearest to a mistyped one first where it is near enough:
///
///   did you mean `rows`? known are `columns`, `rows`
///
/// Near enough is a third of the letters, counted as slips: a letter too many, too few or wrong, or
/// two neighbours swapped [damerau1964].
std::string known_names(const std::string& mistyped, const std::vector<std::string>& known);

}  // namespace clothfit
