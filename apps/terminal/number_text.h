#pragma once

#include <string>

namespace clothfit {

/// Writes `value` to `digits` significant digits, "-" where it is not a number: a report never
/// prints NaN. It is plain between 1e-4 and 1e6, otherwise with an exponent ("1.2e-05").
std::string significant(double value, int digits);

/// Writes `value` rounded where its sigma's second digit stands; to four digits when sigma is 0.
std::string value_text(double value, double sigma);

/// Writes the shortest text that reads back to the same double; empty for no number. For CSV.
std::string exact_text(double value);

/// Says whether a table's cell shows a number, a percentage or the absence of one. Such cells stand
/// to the right.
bool shows_number(const std::string& cell);

}  // namespace clothfit
