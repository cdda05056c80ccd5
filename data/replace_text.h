#pragma once

#include <filesystem>
#include <string>

namespace clothfit {

/// Writes `text` as `write_text` does, in one step: whatever stops the program or the machine, the
/// file holds what it held before or the whole of `text`. What a killed program leaves beside it,
/// `.partial.NAME`, is overwritten by the next call. Throws InputError when the file cannot be
/// written.
void replace_text(const std::string& text, const std::filesystem::path& file);

}  // namespace clothfit
