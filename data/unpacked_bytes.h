#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

namespace clothfit {

/// Reads the content of a file, decompressed where its name ends in `.gz`. Throws InputError when
/// the name does not tell whether the content is compressed, when compressed data are damaged, cut
/// short, or followed by other bytes, and when they unpack beyond what measurements do.
class UnpackedBytes {
 public:
  explicit UnpackedBytes(const std::filesystem::path& file);
  ~UnpackedBytes();

  /// Reads `most` bytes at most; 0 at the end.
  size_t read(char* to, size_t most);

  class Source;

 private:
  std::unique_ptr<Source> source_;
};

}  // namespace clothfit
