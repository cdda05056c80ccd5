#pragma once

#include <fmt/format.h>

#include <string>
#include <string_view>

namespace clothfit {

/// One line that names all that determines the pieces of a run, field by field:
/// "STUDY; NAME=VALUE; NAME=VALUE". A journal of another run is refused by the names of the fields
/// that differ. Two fields are in every key: the program's version and its arithmetic, for other
/// versions and other roundings give other bits.
class JournalKey {
 public:
  /// `study` names the run's kind and the version of its pieces, such as "recover/3".
  explicit JournalKey(std::string study);

  /// Adds a field. Neither the name nor the value's text may hold a line's end or a semicolon,
  /// which become blanks.
  template <class Value>
  JournalKey& add(std::string_view name, const Value& value) {
    add_text(name, fmt::format("{}", value));
    return *this;
  }

  const std::string& line() const { return line_; }

 private:
  void add_text(std::string_view name, std::string text);

  std::string line_;
};

/// Says what of a key differs from another, for a person: "noise_m=0.0005, seed=1". A field that
/// only the other has is shown as "NAME not given". Of lines that are no keys of fields, all.
std::string differing_fields(std::string_view key, std::string_view other);

}  // namespace clothfit
