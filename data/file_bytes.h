#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>

namespace clothfit {

/// Reads a regular file from its beginning. A folder, a FIFO, a socket or a device is refused, and
/// opening one never waits. Throws InputError with the system's reason.
class FileBytes {
 public:
  explicit FileBytes(const std::filesystem::path& file);
  ~FileBytes();
  FileBytes(const FileBytes&) = delete;
  FileBytes& operator=(const FileBytes&) = delete;

  /// Returns the size when it was opened, in bytes; files of /proc state 0.
  std::uintmax_t size() const { return size_; }
  /// Reads `most` bytes at most; 0 at the end.
  size_t read(char* to, size_t most);
  /// Gives the descriptor away; the caller closes it.
  int release();

 private:
  std::string file_;
  int descriptor_ = -1;
  std::uintmax_t size_ = 0;
};

/// Returns the whole of a regular file. Throws InputError, also when it holds more than
/// `most_bytes`.
std::string read_file_bytes(const std::filesystem::path& file, std::uintmax_t most_bytes);

/// Returns an open descriptor of a regular file, for libraries that read by themselves. Throws
/// InputError as FileBytes does; the caller closes it.
int open_regular_file(const std::filesystem::path& file);

/// Throws the InputError of a file with too many bytes.
[[noreturn]] void refuse_file_size(const std::filesystem::path& file, std::uintmax_t most_bytes);

}  // namespace clothfit
