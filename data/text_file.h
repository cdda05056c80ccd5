#pragma once

#include <filesystem>
#include <string>

namespace clothfit {

/// Returns the whole of a text file, decompressed when its name ends in `.gz`. A byte order mark is
/// left out, and `\n` is the only line end. Throws InputError when nothing is there, when it cannot
/// be read, when compressed data are cut short or damaged, or when the name does not tell whether
/// the content is compressed.
std::string read_text(const std::filesystem::path& file);

/// Writes `text`, compressed when the name ends in `.gz`; the same text gives the same bytes.
/// Throws InputError when the file cannot be written.
void write_text(const std::string& text, const std::filesystem::path& file);

}  // namespace clothfit
