#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "data/file_limits.h"
#include "data/unpacked_bytes.h"

namespace clothfit {

/// Reads a text file line by line, decompressed when its name ends in `.gz`; the file may be larger
/// than the memory. A byte order mark is left out; `\n`, `\r\n` and `\r` end a line. Throws
/// InputError when it cannot be read, and at a NUL byte or a line of more than kMostLineBytes.
class TextLines {
 public:
  explicit TextLines(const std::filesystem::path& file);

  /// Goes to the next line; false at the end.
  bool next();
  /// Returns the present line without its end, valid until the next one.
  std::string_view text() const { return text_; }
  /// Returns the number of the present line, from 1.
  int line() const { return line_; }

 private:
  /// Moves unused bytes to the front of the buffer and reads on; false at the end.
  bool read_on();

  std::string file_;
  UnpackedBytes bytes_;
  std::string buffer_;
  size_t begin_ = 0, end_ = 0;  ///< of what is not used yet
  std::string_view text_;
  int line_ = 0;
};

/// Returns the whole of a text file, decompressed when its name ends in `.gz`. A byte order mark is
/// left out, and `\n` is the only line end. Throws InputError when nothing is there, when it cannot
/// be read, when compressed data are cut short or damaged, when the name does not tell whether the
/// content is compressed, and where it holds a NUL byte or more than `most_bytes`.
std::string read_text(const std::filesystem::path& file,
                      std::uintmax_t most_bytes = kMostTextBytes);

/// Writes `text`, compressed when the name ends in `.gz`; the same text gives the same bytes. Links
/// are not followed. Throws InputError when the file cannot be written.
void write_text(std::string_view text, const std::filesystem::path& file);

}  // namespace clothfit
