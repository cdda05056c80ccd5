#pragma once

#include <filesystem>
#include <string>

namespace clothfit {

/// Returns the folder of a recording that comes with the program. It is beside the installed
/// program (in ../share/clothfit/recordings) or in the source tree it was built from. Throws
/// InputError when it is at neither place.
std::filesystem::path bundled_recording(const std::string& name);

/// Returns the file of a sewing pattern that comes with the program, in the same way.
std::filesystem::path bundled_pattern(const std::string& name);

}  // namespace clothfit
