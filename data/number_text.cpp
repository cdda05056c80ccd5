#include "data/number_text.h"

#include <array>
#include <cassert>
#include <charconv>
#include <cmath>

namespace clothfit {
namespace {

template <class Number>
std::optional<Number> parse(std::string_view text) {
  // from_chars knows no leading plus; "+-1" stays refused.
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  Number value{};
  const char* const end = text.data() + text.size();
  const auto [stopped_at, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc() || stopped_at != end) return std::nullopt;
  return value;
}

}  // namespace

std::optional<double> parse_number(std::string_view text) {
  const std::optional<double> value = parse<double>(text);
  if (!value || !std::isfinite(*value)) return std::nullopt;
  return value;
}

std::optional<int> parse_whole_number(std::string_view text) {
  return parse<int>(text);
}

std::string number_text(double value) {
  assert(std::isfinite(value));
  std::array<char, 32> text;  // the longest, -2.2250738585072014e-308, has 24
  const auto [end, error] = std::to_chars(text.data(), text.data() + text.size(), value);
  assert(error == std::errc());
  static_cast<void>(error);
  return {text.data(), end};
}

}  // namespace clothfit
