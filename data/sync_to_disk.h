#pragma once

#include <filesystem>

namespace clothfit {

/// Forces a file, or the names in a folder, onto the disk. Returns 0, or the error number.
int sync_to_disk(const std::filesystem::path& path);

}  // namespace clothfit
