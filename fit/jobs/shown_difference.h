#pragma once

#include <algorithm>
#include <string>
#include <string_view>

#include "data/shown_text.h"

namespace clothfit {

/// Returns the part of `text` that an error message shows where it is not `other`. A short text is
/// shown whole, a long one from the word in which they first differ.
inline std::string shown_difference(std::string_view text, std::string_view other) {
  constexpr size_t kShort = 60;
  if (text.size() <= kShort) return shown_text(text);
  const auto differs = std::ranges::mismatch(text, other).in1 - text.begin();
  const size_t space = text.substr(0, static_cast<size_t>(differs)).rfind(' ');
  if (space == std::string_view::npos) return shown_text(text);
  return "... " + shown_text(text.substr(space + 1));
}

}  // namespace clothfit
