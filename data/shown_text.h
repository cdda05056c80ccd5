#pragma once

#include <string>
#include <string_view>

namespace clothfit {

/// Returns a user's text for an error message, whatever it holds: one short line.
inline std::string shown_text(std::string_view text) {
  constexpr size_t kLongest = 60;
  std::string shown(text.substr(0, kLongest));
  for (char& c : shown)
    if (static_cast<unsigned char>(c) < ' ' || c == 127) c = '?';
  if (text.size() > kLongest) shown += "...";
  return shown;
}

}  // namespace clothfit
