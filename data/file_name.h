#pragma once

#include <algorithm>
#include <string_view>

namespace clothfit {

/// Whether a name can also name files, such as cameras/NAME.yaml or NAME.fit, inside the folder
/// where they belong: printable, without a slash, no dot in front.
inline bool can_name_a_file(std::string_view name) {
  return !name.empty() && name.front() != '.' && std::none_of(name.begin(), name.end(), [](char c) {
    return static_cast<unsigned char>(c) < ' ' || c == 127 || c == '/';
  });
}

}  // namespace clothfit
