#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>

#include "data/input_error.h"

namespace clothfit {

/// A folder that one process of a fuzzer writes its inputs to, below TMPDIR. `./run fuzz` lays it
/// in memory. It is removed when the process ends by itself.
const std::filesystem::path& scratch_folder();

/// Writes bytes as they are to a file of the scratch folder; returns its path.
std::filesystem::path write_scratch(std::string_view name, std::string_view bytes);

/// Splits an input into its files. Each begins with a line "=== NAME"; text in front of the first
/// belongs to `first`. A name that could leave the folder is passed over, as are later ones of the
/// same name.
std::map<std::string, std::string> files_of(std::string_view input, const std::string& first);

/// Empties the scratch folder and writes all files of an input. One whose name ends in .gz is
/// compressed, so that what is damaged is its text. Returns the folder.
const std::filesystem::path& write_files(const std::map<std::string, std::string>& files);

/// Calls `read`, and lets no more pass than the refusal of a user's mistake.
template <class Read>
void read_or_refuse(const Read& read) {
  try {
    read();
  } catch (const InputError&) {
    // The right answer to most inputs.
  }
}

/// Returns the input of a fuzzer as text.
inline std::string_view text_of(const std::uint8_t* data, size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

}  // namespace clothfit
