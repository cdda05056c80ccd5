#pragma once

#include <filesystem>

namespace clothfit {

/// The recordings of the repository.
inline const std::filesystem::path kBundled =
    std::filesystem::path(CLOTHFIT_SOURCE_DIR) / "data" / "recordings";

}  // namespace clothfit
