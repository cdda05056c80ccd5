#pragma once

#include <string_view>

#include "data/shown_text.h"

namespace clothfit {

/// Says whether a name can also name files, such as cameras/NAME.yaml or NAME.fit, in their folder.
/// Such a name is printable, without a slash and without a dot in front.
inline bool can_name_a_file(std::string_view name) {
  return !name.empty() && name.front() != '.' && name.find('/') == std::string_view::npos &&
         is_printable(name);
}

}  // namespace clothfit
