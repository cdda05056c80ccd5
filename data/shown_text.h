#pragma once

#include <string>
#include <string_view>

namespace clothfit {

/// What an error message shows of a user's text, whatever it holds: one short line.
inline std::string shown_text(std::string_view text) {
  constexpr std::size_t kLongest = 60;
  std::string shown(text.substr(0, kLongest));
  for (char& c : shown) {
    if (static_cast<unsigned char>(c) < ' ' || c == 127) c = '?';
  }
  if (text.size() > kLongest) shown += "...";
  return shown;
}

}  // namespace clothfit
