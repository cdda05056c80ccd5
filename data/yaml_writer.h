#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <span>
#include <string>

#include "data/number_text.h"

namespace clothfit {

/// Writes YAML in the style of docs/formats.md: keys line by line at the top, short maps and lists
/// within braces and brackets, numbers in their shortest exact form. Inside data/ only.
class YamlWriter {
 public:
  YamlWriter();

  YamlWriter& begin_map();  ///< line by line
  YamlWriter& end_map();
  YamlWriter& begin_flow_map();  ///< {a: 1, b: 2}
  YamlWriter& begin_list();      ///< an item per line
  YamlWriter& begin_flow_list();
  YamlWriter& end_list();

  YamlWriter& key(const std::string& name);
  YamlWriter& value(const std::string& text);
  YamlWriter& value(double number);
  YamlWriter& value(int number);
  YamlWriter& value(std::span<const double> numbers);
  YamlWriter& null();

  /// Returns the whole document, ending with a new line.
  std::string text() const;

 private:
  YAML::Emitter out_;
};

}  // namespace clothfit
