#pragma once

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace clothfit {

class YamlMap;

/// A value of a YAML file that knows its place and its name. Every refusal can therefore say file,
/// line and name. Inside data/ only.
class YamlValue {
 public:
  YamlValue(YAML::Node node, std::shared_ptr<const std::string> file, std::string name, int line);

  const std::string& file() const { return *file_; }
  const std::string& name() const { return name_; }
  int line() const { return line_; }
  bool is_null() const { return node_.IsNull(); }
  bool is_number() const;
  bool is_word(const std::string& word) const;
  bool is_list() const { return node_.IsSequence(); }
  bool is_map() const { return node_.IsMap(); }

  /// Returns a scalar that is not empty.
  std::string text() const;
  double number() const;
  /// Returns a number from `least` to `most`; `what` names the quantity in the message. The bounds
  /// catch slips in an exponent, which would otherwise be simulated.
  double number_between(double least, double most, const std::string& what) const;
  int whole_number(int least, int most = std::numeric_limits<int>::max()) const;
  std::vector<double> numbers() const;
  /// Returns exactly N numbers.
  template <size_t N>
  std::array<double, N> numbers() const;
  /// Returns exactly N numbers, each from `least` to `most`.
  template <size_t N>
  std::array<double, N> numbers_between(double least, double most, const std::string& what) const;
  std::vector<YamlValue> items() const;
  /// Returns a map of known keys.
  YamlMap map(const std::vector<std::string>& known_keys) const;
  /// Returns a map whose keys are the user's names, in their order.
  std::vector<std::pair<std::string, YamlValue>> entries() const;
  /// Returns the choice that one word of a list stands for.
  template <class Choice>
  Choice one_of(const std::vector<std::pair<std::string, Choice>>& choices) const;

  [[noreturn]] void refuse(const std::string& problem, const std::string& expected,
                           const std::string& remedy = "") const;

 private:
  std::vector<double> numbers_of(size_t count) const;
  size_t place_of(const std::vector<std::string>& words) const;
  /// Returns `NAME = value`, as an error message shows it.
  std::string shown() const;

  YAML::Node node_;
  std::shared_ptr<const std::string> file_;
  std::string name_;  ///< such as cloth.mesh.rows or held[1].at
  int line_ = 1;
};

/// A YAML map whose keys are all known.
class YamlMap {
 public:
  YamlMap(YamlValue whole, std::vector<std::pair<std::string, YamlValue>> entries);
  /// Returns a value; refuses a missing or empty one.
  const YamlValue& at(const std::string& key) const;
  /// Returns a value; nothing when it is missing or null.
  const YamlValue* find(const std::string& key) const;
  const YamlValue& whole() const { return whole_; }

 private:
  YamlValue whole_;
  std::vector<std::pair<std::string, YamlValue>> entries_;
};

/// Reads a file of one YAML document. Throws InputError, also for what YAML's own grammar refuses.
YamlValue read_yaml(const std::filesystem::path& file);

template <size_t N>
std::array<double, N> YamlValue::numbers() const {
  const std::vector<double> all = numbers_of(N);
  std::array<double, N> result{};
  std::copy(all.begin(), all.end(), result.begin());
  return result;
}

template <size_t N>
std::array<double, N> YamlValue::numbers_between(double least, double most,
                                                 const std::string& what) const {
  const std::array<double, N> result = numbers<N>();
  for (const YamlValue& item : items()) item.number_between(least, most, what);
  return result;
}

template <class Choice>
Choice YamlValue::one_of(const std::vector<std::pair<std::string, Choice>>& choices) const {
  std::vector<std::string> words;
  for (const auto& [word, choice] : choices) words.push_back(word);
  return choices[place_of(words)].second;
}

}  // namespace clothfit
