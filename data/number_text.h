#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace clothfit {

/// Returns the number that the whole of `text` spells, correctly rounded and whatever the locale.
/// Nothing when it spells none, one that is not finite, or one that does not fit.
std::optional<double> parse_number(std::string_view text);
std::optional<int> parse_whole_number(std::string_view text);

/// Returns the shortest text that reads back as the same double.
std::string number_text(double value);

}  // namespace clothfit
