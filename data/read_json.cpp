#include "data/read_json.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <vector>

#include "data/input_error.h"
#include "data/reading.h"
#include "data/shown_text.h"
#include "data/text_file.h"

namespace clothfit {

namespace {

nlohmann::json parsed_json(const std::filesystem::path& file, const std::string& expected,
                           const std::string& remedy) {
  using Json = nlohmann::json;
  const std::string text = read_text(file, kMostJsonBytes);
  std::vector<std::set<std::string>> keys;  // of each object that is open
  const auto refuse_second_key = [&](int, Json::parse_event_t event, Json& parsed) {
    if (event == Json::parse_event_t::object_start) keys.emplace_back();
    if (event == Json::parse_event_t::object_end) keys.pop_back();
    if (event == Json::parse_event_t::key && !keys.back().insert(parsed.get<std::string>()).second)
      throw InputError(file.string(),
                       "key `" + shown_text(parsed.get<std::string>()) + "` comes twice",
                       "every key once in an object", remedy);
    return true;
  };
  try {
    return Json::parse(text, refuse_second_key);
  } catch (const Json::parse_error& error) {
    const auto stopped_at = static_cast<std::ptrdiff_t>(std::min(error.byte, text.size()));
    const auto line = 1 + std::count(text.begin(), text.begin() + stopped_at, '\n');
    throw InputError(file.string(), static_cast<int>(line), "not JSON", expected, remedy);
  } catch (const Json::exception&) {  // a number too large for any type
    throw InputError(file.string(), "holds a number too large", expected, remedy);
  }
}

}  // namespace

nlohmann::json read_json(const std::filesystem::path& file, const std::string& expected,
                         const std::string& remedy) {
  return reading(file, [&] { return parsed_json(file, expected, remedy); });
}

}  // namespace clothfit
