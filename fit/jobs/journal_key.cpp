#include "fit/jobs/journal_key.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "data/program_version.h"
#include "data/shown_text.h"
#include "fit/jobs/arithmetic.h"

namespace clothfit {
namespace {

constexpr std::string_view kBetween = "; ";

struct Field {
  std::string_view name, value;
};

/// The first field is the study, without a name.
std::vector<Field> fields_of(std::string_view line) {
  std::vector<Field> fields;
  while (true) {
    const size_t end = std::min(line.find(kBetween), line.size());
    const std::string_view field = line.substr(0, end);
    const size_t equals = field.find('=');
    if (fields.empty() || equals == std::string_view::npos)
      fields.push_back({.name = {}, .value = field});
    else
      fields.push_back({.name = field.substr(0, equals), .value = field.substr(equals + 1)});
    if (end == line.size()) return fields;
    line.remove_prefix(end + kBetween.size());
  }
}

}  // namespace

JournalKey::JournalKey(std::string study) : line_(std::move(study)) {
  add("clothfit", program_version()).add("arithmetic", arithmetic_name());
}

void JournalKey::add_text(std::string_view name, std::string text) {
  std::ranges::replace_if(
      text, [](char c) { return c == '\n' || c == ';'; }, ' ');
  line_ += fmt::format("{}{}={}", kBetween, name, text);
}

std::string differing_fields(std::string_view key, std::string_view other) {
  const std::vector<Field> own = fields_of(key), others = fields_of(other);
  std::string text;
  const auto add = [&](const std::string& field) { text += (text.empty() ? "" : ", ") + field; };
  for (const Field& field : own) {
    const auto same = std::ranges::find(others, field.name, &Field::name);
    if (same != others.end() && same->value == field.value) continue;
    add(field.name.empty() ? shown_text(field.value)
                           : fmt::format("{}={}", field.name, shown_text(field.value)));
  }
  for (const Field& field : others)
    if (std::ranges::find(own, field.name, &Field::name) == own.end())
      add(fmt::format("{} not given", field.name));
  return text;
}

}  // namespace clothfit
