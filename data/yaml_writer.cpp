#include "data/yaml_writer.h"

#include <cassert>

namespace clothfit {

YamlWriter::YamlWriter() {
  out_.SetNullFormat(YAML::LowerNull);
}

YamlWriter& YamlWriter::begin_map() {
  out_ << YAML::Block << YAML::BeginMap;
  return *this;
}

YamlWriter& YamlWriter::end_map() {
  out_ << YAML::EndMap;
  return *this;
}

YamlWriter& YamlWriter::begin_flow_map() {
  out_ << YAML::Flow << YAML::BeginMap;
  return *this;
}

YamlWriter& YamlWriter::begin_list() {
  out_ << YAML::Block << YAML::BeginSeq;
  return *this;
}

YamlWriter& YamlWriter::begin_flow_list() {
  out_ << YAML::Flow << YAML::BeginSeq;
  return *this;
}

YamlWriter& YamlWriter::end_list() {
  out_ << YAML::EndSeq;
  return *this;
}

YamlWriter& YamlWriter::key(const std::string& name) {
  out_ << YAML::Key << name << YAML::Value;
  return *this;
}

YamlWriter& YamlWriter::value(const std::string& text) {
  out_ << text;
  return *this;
}

YamlWriter& YamlWriter::value(double number) {
  out_ << number_text(number);
  return *this;
}

YamlWriter& YamlWriter::value(int number) {
  out_ << number;
  return *this;
}

YamlWriter& YamlWriter::value(std::span<const double> numbers) {
  begin_flow_list();
  for (const double number : numbers) value(number);
  return end_list();
}

YamlWriter& YamlWriter::null() {
  out_ << YAML::Null;
  return *this;
}

std::string YamlWriter::text() const {
  assert(out_.good());
  return std::string(out_.c_str(), out_.size()) + "\n";
}

}  // namespace clothfit
