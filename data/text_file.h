#pragma once

#include <filesystem>
#include <string>

namespace clothfit {

/// The whole of a text file, decompressed when its name ends in `.gz`, without a byte order mark
/// and with `\n` as the only line end. Throws InputError: nothing there, cannot be read, compressed
/// data cut short or damaged, or a name that does not tell whether the content is compressed.
std::string read_text(const std::filesystem::path& file);

/// Writes `text`, compressed when the name ends in `.gz`; the same text gives the same bytes.
/// Throws InputError when the file cannot be written.
void write_text(const std::string& text, const std::filesystem::path& file);

}  // namespace clothfit
