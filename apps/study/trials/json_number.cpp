#include "apps/study/trials/json_number.h"

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

namespace clothfit {

nlohmann::ordered_json json_number(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
}

double number_of_json(const nlohmann::ordered_json& json) {
  return json.is_null() ? std::numeric_limits<double>::quiet_NaN() : json.get<double>();
}

}  // namespace clothfit
