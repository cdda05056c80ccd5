#pragma once

#include <string>
#include <string_view>

namespace clothfit {

/// Replaces what a terminal could take for a command: control characters, also those of two bytes
/// in UTF-8 (U+0080 to U+009F). Line ends stay where `keep_lines` says so.
inline std::string without_controls(std::string text, bool keep_lines = false) {
  for (size_t i = 0; i < text.size(); ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    const bool kept = keep_lines && (byte == '\n' || byte == '\t');
    if (!kept && (byte < ' ' || byte == 127)) text[i] = '?';
    const auto next = static_cast<unsigned char>(i + 1 < text.size() ? text[i + 1] : 0);
    if (byte == 0xc2 && next >= 0x80 && next < 0xa0) text[i] = text[i + 1] = '?';
  }
  return text;
}

/// Says whether a text is one line without control characters.
inline bool is_printable(std::string_view text) {
  return without_controls(std::string(text)) == text;
}

/// Returns a user's text for an error message, whatever it holds: one short line.
inline std::string shown_text(std::string_view text) {
  constexpr size_t kLongest = 60;
  std::string shown = without_controls(std::string(text.substr(0, kLongest)));
  if (text.size() > kLongest) shown += "...";
  return shown;
}

}  // namespace clothfit
