#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace clothfit {

/// Returns the families of which some pictures of a folder or a video, spread over it, clearly show
/// tags; most tags first. Throws InputError for pictures that cannot be read.
std::vector<std::string> families_shown(const std::filesystem::path& images);

}  // namespace clothfit
