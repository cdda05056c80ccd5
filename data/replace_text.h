#pragma once

#include <filesystem>
#include <string>

namespace clothfit {

/// Writes `text` as `write_text` does, in one step. Whatever stops the program or the machine, the
/// file holds its former content or the whole of `text`. The file that a killed program leaves
/// beside it, `.NAME.partial-PID`, is removed by the next call. Throws InputError when the file
/// cannot be written.
void replace_text(const std::string& text, const std::filesystem::path& file);

}  // namespace clothfit
