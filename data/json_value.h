#pragma once

#include <fmt/format.h>

#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "data/input_error.h"

namespace clothfit {

/// A JSON file in messages: its name, what it should be and what to do where it is not.
struct JsonFile {
  std::string name, expected, remedy;
};

/// A value of a JSON file that knows its place, such as /parameters/2/value.
class JsonValue {
 public:
  JsonValue(const nlohmann::json& json, const JsonFile& file, std::string place)
      : json_(json), file_(file), place_(std::move(place)) {}

  bool has(const std::string& key) const { return json_.is_object() && json_.contains(key); }
  bool is_list() const { return json_.is_array(); }
  JsonValue at(const std::string& key) const {
    if (!json_.is_object()) refuse("is not an object", "an object");
    if (!json_.contains(key))
      throw InputError(file_.name, "`" + place_ + "/" + key + "` is missing", file_.expected,
                       file_.remedy);
    return {json_.at(key), file_, place_ + "/" + key};
  }
  std::vector<JsonValue> items() const {
    if (!json_.is_array()) refuse("is not a list", "a list");
    std::vector<JsonValue> items;
    for (const nlohmann::json& item : json_)
      items.emplace_back(item, file_, fmt::format("{}/{}", place_, items.size()));
    return items;
  }
  std::vector<std::string> keys() const {
    if (!json_.is_object()) refuse("is not an object", "an object");
    std::vector<std::string> keys;
    for (const auto& [key, value] : json_.items()) keys.push_back(key);
    return keys;
  }
  std::string text() const {
    if (!json_.is_string()) refuse("is not text", "text");
    return json_.get<std::string>();
  }
  std::string text_or_empty(const std::string& key) const {
    return has(key) ? at(key).text() : std::string();
  }
  bool truth() const {
    if (!json_.is_boolean()) refuse("is not a truth", "true or false");
    return json_.get<bool>();
  }
  double number() const {
    if (!json_.is_number()) refuse("is not a number", "a number");
    return json_.get<double>();
  }
  /// Bounds catch slips in an exponent, which would otherwise be simulated.
  double number_from(double least, double most) const {
    const double value = number();
    if (value < least || value > most)
      refuse(fmt::format("is {}", value), fmt::format("a number from {:g} to {:g}", least, most));
    return value;
  }
  double number_or_nan() const {
    return json_.is_null() ? std::numeric_limits<double>::quiet_NaN() : number();
  }
  int count() const {
    const bool fits = json_.is_number_unsigned() &&
                      json_.get<unsigned long long>() <=
                          static_cast<unsigned long long>(std::numeric_limits<int>::max());
    if (!fits) refuse("is not a count", "a whole number, 0 or more");
    return json_.get<int>();
  }
  int count_from(int least, int most) const {
    const int value = count();
    if (value < least || value > most)
      refuse(fmt::format("is {}", value), fmt::format("a whole number, {} to {}", least, most));
    return value;
  }
  unsigned long long seed() const {
    if (!json_.is_number_unsigned()) refuse("is not a seed", "a whole number, 0 or more");
    return json_.get<unsigned long long>();
  }
  [[noreturn]] void refuse(const std::string& problem, const std::string& expected) const {
    throw InputError(file_.name, "`" + (place_.empty() ? "/" : place_) + "` " + problem, expected);
  }

 private:
  const nlohmann::json& json_;
  const JsonFile& file_;
  std::string place_;
};

}  // namespace clothfit
