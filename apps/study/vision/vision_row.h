#pragma once

#include <string>

namespace clothfit {

/// One line of the study: a way to spoil pictures, a set of pictures, or what they lead to.
struct VisionRow {
  std::string name;  ///< for --rows
  std::string what;
};

}  // namespace clothfit
