#include "data/yaml_value.h"

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>

#include <algorithm>
#include <sstream>
#include <unordered_map>

#include "data/input_error.h"
#include "data/nearest_name.h"
#include "data/number_text.h"
#include "data/reading.h"
#include "data/shown_text.h"
#include "data/text_file.h"

namespace clothfit {
namespace {

/// yaml-cpp counts lines from 0 and marks some empty nodes with -1.
int line_of(const YAML::Mark& mark, int otherwise) {
  return mark.line >= 0 ? mark.line + 1 : otherwise;
}

std::string kind_of(const YAML::Node& node) {
  if (node.IsMap()) return "a map";
  if (node.IsSequence()) return "a list";
  if (node.IsNull()) return "empty";
  return fmt::format("`{}`", shown_text(node.Scalar()));
}

/// Follows a document only to see where it ends.
class LastLine : public YAML::EventHandler {
 public:
  int line() const { return line_; }

  void OnDocumentStart(const YAML::Mark& mark) override { see(mark); }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t) override { see(mark); }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override { see(mark); }
  void OnScalar(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                const std::string&) override {
    see(mark);
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {
    see(mark);
  }
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                  YAML::EmitterStyle::value) override {
    see(mark);
  }
  void OnMapEnd() override {}

 private:
  void see(const YAML::Mark& mark) { line_ = std::max(line_, line_of(mark, 1)); }
  int line_ = 1;
};

/// Refuses text behind the first document; returns the last line of the document's content.
int require_one_document(const std::string& text, const std::string& file) {
  std::istringstream stream(text);
  YAML::Parser parser(stream);
  LastLine last;
  parser.HandleNextDocument(last);
  if (parser)
    throw InputError(file, last.line(), "the YAML document ends here but the file goes on",
                     "one document, `key: value` line by line", "remove what does not belong");
  return last.line();
}

}  // namespace

YamlValue::YamlValue(YAML::Node node, std::shared_ptr<const std::string> file, std::string name,
                     int line)
    : node_(std::move(node)), file_(std::move(file)), name_(std::move(name)), line_(line) {}

void YamlValue::refuse(const std::string& problem, const std::string& expected,
                       const std::string& remedy) const {
  throw InputError(*file_, line_, problem, expected, remedy);
}

std::string YamlValue::shown() const {
  if (name_.empty()) return "the file is " + kind_of(node_);
  if (!node_.IsScalar()) return name_ + " is " + kind_of(node_);
  return name_ + " = " + shown_text(node_.Scalar());
}

bool YamlValue::is_number() const {
  return node_.IsScalar() && parse_number(node_.Scalar()).has_value();
}

bool YamlValue::is_word(const std::string& word) const {
  return node_.IsScalar() && node_.Scalar() == word;
}

std::string YamlValue::text() const {
  if (!node_.IsScalar() || node_.Scalar().empty())
    refuse(name_ + " is " + (node_.IsScalar() ? "empty" : kind_of(node_)), "text");
  return node_.Scalar();
}

double YamlValue::number() const {
  const std::optional<double> value =
      node_.IsScalar() ? parse_number(node_.Scalar()) : std::nullopt;
  if (!value) refuse(shown(), "a finite number");
  return *value;
}

double YamlValue::number_between(double least, double most, const std::string& what) const {
  const double value = number();
  if (value < least || value > most)
    refuse(shown(), fmt::format("{}, {} to {}", what, least, most));
  return value;
}

int YamlValue::whole_number(int least, int most) const {
  const std::optional<int> value =
      node_.IsScalar() ? parse_whole_number(node_.Scalar()) : std::nullopt;
  if (!value || *value < least || *value > most) {
    const bool open = most == std::numeric_limits<int>::max();
    refuse(shown(), open ? fmt::format("a whole number, {} or more", least)
                         : fmt::format("a whole number, {} to {}", least, most));
  }
  return *value;
}

std::vector<double> YamlValue::numbers() const {
  std::vector<double> result;
  for (const YamlValue& item : items()) result.push_back(item.number());
  return result;
}

std::vector<double> YamlValue::numbers_of(size_t count) const {
  const std::string expected = fmt::format("a list of {} numbers", count);
  if (!node_.IsSequence()) refuse(shown(), expected);
  if (node_.size() != count) refuse(fmt::format("{} has {} items", name_, node_.size()), expected);
  return numbers();
}

std::vector<YamlValue> YamlValue::items() const {
  if (!node_.IsSequence()) refuse(shown(), "a list");
  std::vector<YamlValue> items;
  for (const YAML::Node& item : node_)
    items.emplace_back(item, file_, fmt::format("{}[{}]", name_, items.size()),
                       line_of(item.Mark(), line_));
  return items;
}

std::vector<std::pair<std::string, YamlValue>> YamlValue::entries() const {
  if (!node_.IsMap()) refuse(shown(), "a map, `key: value`");
  std::vector<std::pair<std::string, YamlValue>> entries;
  std::unordered_map<std::string, int> line_of_key;
  for (const auto& entry : node_) {
    const int line = line_of(entry.first.Mark(), line_);
    if (!entry.first.IsScalar())
      throw InputError(*file_, line, "a key is " + kind_of(entry.first), "a word before the colon");
    const std::string& key = entry.first.Scalar();
    const auto [earlier, is_new] = line_of_key.emplace(key, line);
    if (!is_new)
      throw InputError(
          *file_, line,
          fmt::format("`{}` stands on line {} already", shown_text(key), earlier->second),
          "every key once", "remove one of the two");
    // An empty value has no useful place of its own, so the key's line serves.
    entries.emplace_back(
        key, YamlValue(entry.second, file_, name_.empty() ? key : name_ + "." + key, line));
  }
  return entries;
}

YamlMap YamlValue::map(const std::vector<std::string>& known_keys) const {
  std::vector<std::pair<std::string, YamlValue>> all = entries();
  for (const auto& [key, value] : all) {
    if (std::find(known_keys.begin(), known_keys.end(), key) == known_keys.end())
      value.refuse(
          fmt::format("unknown key `{}`{}", shown_text(key), name_.empty() ? "" : " in " + name_),
          known_names(key, known_keys));
  }
  return {*this, std::move(all)};
}

size_t YamlValue::place_of(const std::vector<std::string>& words) const {
  const std::string word = text();
  const auto found = std::find(words.begin(), words.end(), word);
  if (found == words.end()) refuse(shown(), known_names(word, words));
  return static_cast<size_t>(found - words.begin());
}

YamlMap::YamlMap(YamlValue whole, std::vector<std::pair<std::string, YamlValue>> entries)
    : whole_(std::move(whole)), entries_(std::move(entries)) {}

const YamlValue* YamlMap::find(const std::string& key) const {
  for (const auto& [name, value] : entries_)
    if (name == key) return value.is_null() ? nullptr : &value;
  return nullptr;
}

const YamlValue& YamlMap::at(const std::string& key) const {
  for (const auto& [name, value] : entries_) {
    if (name != key) continue;
    if (value.is_null()) value.refuse(value.name() + " is empty", "a value");
    return value;
  }
  const std::string within = whole_.name().empty() ? "" : " in " + whole_.name();
  whole_.refuse("`" + key + "` is missing" + within, "a line `" + key + ": ...`");
}

namespace {

YamlValue parsed_yaml(const std::filesystem::path& file) {
  const auto name = std::make_shared<const std::string>(file.string());
  const std::string text = read_text(file, kMostYamlBytes);
  try {
    // YAML::LoadAll hangs on some damaged files (yaml-cpp 0.7 at a stray comma). YAML::Load
    // silently drops whatever follows the first document.
    const int last_line = require_one_document(text, *name);
    const YAML::Node root = YAML::Load(text);
    if (root.IsNull())
      throw InputError(*name, last_line, "holds no keys", "`key: value`, line by line");
    return {root, name, "", line_of(root.Mark(), 1)};
  } catch (const YAML::Exception& error) {
    throw InputError(*name, line_of(error.mark, 1), "not YAML: " + error.msg,
                     "`key: value` lines, indented by spaces", "quote text that holds `: ` or `#`");
  }
}

}  // namespace

YamlValue read_yaml(const std::filesystem::path& file) {
  return reading(file, [&] { return parsed_yaml(file); });
}

}  // namespace clothfit
