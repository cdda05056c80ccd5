#pragma once

#include <nlohmann/json_fwd.hpp>

namespace clothfit {

/// Writes a number as journals keep it: null where it is not finite.
nlohmann::ordered_json json_number(double value);

/// Reads it back; not a number where it is null.
double number_of_json(const nlohmann::ordered_json& json);

}  // namespace clothfit
