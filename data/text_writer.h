#pragma once

#include <filesystem>
#include <memory>
#include <string_view>

namespace clothfit {

/// What stands at a path before it is written.
enum class WriteStart {
  replace,  ///< nothing or a file, which is written from its beginning
  create,   ///< nothing; a file or a link there is refused
};

/// Writes a file piece by piece, compressed when its name ends in `.gz`; the same text gives the
/// same bytes. A link at the path is never followed. Throws InputError when the file cannot be
/// written.
class TextWriter {
 public:
  explicit TextWriter(const std::filesystem::path& file, WriteStart start = WriteStart::replace);
  ~TextWriter();

  void append(std::string_view text);
  /// Writes what was held back; without it the file is not whole.
  void close();

  class Sink;

 private:
  std::unique_ptr<Sink> sink_;
};

}  // namespace clothfit
