#pragma once

#include <algorithm>
#include <string_view>

namespace clothfit {

/// Says whether a name can also name files, such as cameras/NAME.yaml or NAME.fit, in their folder.
/// Such a name is printable, without a slash and without a dot in front.
inline bool can_name_a_file(std::string_view name) {
  return !name.empty() && name.front() != '.' && std::none_of(name.begin(), name.end(), [](char c) {
    return static_cast<unsigned char>(c) < ' ' || c == 127 || c == '/';
  });
}

}  // namespace clothfit
