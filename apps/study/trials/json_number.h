#pragma once

#include <nlohmann/json_fwd.hpp>
#include <stdexcept>

namespace clothfit {

/// Writes a number as journals keep it: null where it is not finite.
nlohmann::ordered_json json_number(double value);

/// Reads it back; not a number where it is null.
double number_of_json(const nlohmann::ordered_json& json);

/// Returns the choice with a number from 0 to that of `last`. Throws std::out_of_range.
template <class Choice>
Choice choice_of_json(const nlohmann::ordered_json& json, Choice last) {
  const double number = number_of_json(json);
  if (!(number >= 0 && number <= static_cast<int>(last))) throw std::out_of_range("no such choice");
  return static_cast<Choice>(static_cast<int>(number));
}

}  // namespace clothfit
