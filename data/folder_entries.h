#pragma once

#include <filesystem>
#include <vector>

namespace clothfit {

/// Returns what lies in a folder, sorted by path: the order of a file system is chance. Throws
/// InputError with the system's reason where the folder cannot be read.
std::vector<std::filesystem::path> folder_entries(const std::filesystem::path& folder);

}  // namespace clothfit
