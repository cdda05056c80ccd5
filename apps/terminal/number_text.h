#pragma once

#include <string>

namespace clothfit {

/// `value` to `digits` significant digits, "-" where it is not a number: a report never prints NaN.
/// Plain between 1e-4 and 1e6, otherwise with an exponent ("1.2e-05").
std::string significant(double value, int digits);

/// `value` rounded where its sigma's second digit stands; to four digits when sigma is 0.
std::string value_text(double value, double sigma);

/// Shortest text that reads back to the same double; empty where it is not a number. For CSV.
std::string exact_text(double value);

/// Whether a table's cell shows a number, a percentage or the absence of one: those stand to the
/// right.
bool shows_number(const std::string& cell);

}  // namespace clothfit
