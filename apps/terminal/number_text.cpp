#include "apps/terminal/number_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string_view>

#include "data/number_text.h"

namespace clothfit {
namespace {

/// Returns the power of ten of the first digit of `value` once rounded to `digits` digits.
int first_digit_exponent(double value, int digits) {
  const std::string text = fmt::format("{:.{}e}", std::abs(value), digits - 1);
  return std::stoi(text.substr(text.find('e') + 1));
}

bool is_plain(int exponent) {
  return exponent >= -4 && exponent < 6;
}

}  // namespace

std::string significant(double value, int digits) {
  if (!std::isfinite(value)) return "-";
  if (value == 0) return "0";
  const int exponent = first_digit_exponent(value, digits);
  if (!is_plain(exponent)) return fmt::format("{:.{}e}", value, digits - 1);
  return fmt::format("{:.{}f}", value, std::max(0, digits - 1 - exponent));
}

std::string value_text(double value, double sigma) {
  if (!std::isfinite(value)) return "-";
  if (!std::isfinite(sigma) || sigma <= 0) return significant(value, 4);
  const int sigma_exponent = first_digit_exponent(sigma, 2);
  const int exponent = value == 0 ? sigma_exponent : first_digit_exponent(value, 2);
  if (is_plain(exponent) || (is_plain(sigma_exponent) && exponent < 6))
    return fmt::format("{:.{}f}", value, std::max(0, 1 - sigma_exponent));
  return fmt::format("{:.{}e}", value, std::clamp(exponent - sigma_exponent + 1, 0, 15));
}

std::string exact_text(double value) {
  return std::isfinite(value) ? number_text(value) : "";
}

bool shows_number(const std::string& cell) {
  if (cell.empty() || cell == "-") return true;
  char* end = nullptr;
  std::strtod(cell.c_str(), &end);
  const std::string_view rest(end);
  return rest.empty() || rest == "%" || rest == " %";
}

}  // namespace clothfit
