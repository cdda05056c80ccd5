#include "data/file_bytes.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "data/input_error.h"
#include "data/reading.h"

namespace clothfit {
namespace {

/// Says what a path leads to that is no regular file.
std::string file_kind(mode_t mode) {
  if (S_ISDIR(mode)) return "a folder";
  if (S_ISFIFO(mode)) return "a named pipe";
  if (S_ISSOCK(mode)) return "a socket";
  return "a device";
}

[[noreturn]] void refuse_kind(const std::string& file, mode_t mode) {
  throw InputError(file, "is " + file_kind(mode), "a file",
                   S_ISDIR(mode) ? "name the file inside it" : "copy its content to a file");
}

[[noreturn]] void refuse_opening(const std::string& file, int error_number) {
  if (error_number == ENOENT || error_number == ENOTDIR)
    throw InputError(file, "there is no such file", "a file", "check the path");
  struct stat status {};
  if (stat(file.c_str(), &status) == 0 && !S_ISREG(status.st_mode))
    refuse_kind(file, status.st_mode);
  throw UnreadableFile(file, std::string("cannot be opened: ") + std::strerror(error_number),
                       "a readable file");
}

}  // namespace

FileBytes::FileBytes(const std::filesystem::path& file) : file_(file.string()) {
  // Without O_NONBLOCK, opening a named pipe waits until somebody writes.
  descriptor_ = open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
  if (descriptor_ < 0) refuse_opening(file_, errno);
  struct stat status {};
  const int error_number = fstat(descriptor_, &status) == 0 ? 0 : errno;
  if (error_number == 0 && S_ISREG(status.st_mode)) {
    size_ = static_cast<std::uintmax_t>(status.st_size);
    return;
  }
  close(descriptor_);
  if (error_number != 0) refuse_opening(file_, error_number);
  refuse_kind(file_, status.st_mode);
}

FileBytes::~FileBytes() {
  if (descriptor_ >= 0) close(descriptor_);
}

size_t FileBytes::read(char* to, size_t most) {
  for (;;) {
    const ssize_t count = ::read(descriptor_, to, most);
    if (count >= 0) return static_cast<size_t>(count);
    if (errno != EINTR)
      throw UnreadableFile(file_, std::string("cannot be read: ") + std::strerror(errno),
                           "a readable file", "copy it again, to a disk without errors");
  }
}

int FileBytes::release() {
  return std::exchange(descriptor_, -1);
}

namespace {

std::string whole_file(const std::filesystem::path& file, std::uintmax_t most_bytes) {
  FileBytes in(file);
  if (in.size() > most_bytes) refuse_file_size(file, most_bytes);
  std::string bytes(static_cast<size_t>(in.size()), '\0');
  constexpr size_t kBlock = 1 << 16;
  for (size_t filled = 0;;) {
    // A file may hold more than it stated: it grows, or it is one of /proc.
    if (filled == bytes.size())
      bytes.resize(static_cast<size_t>(std::min<std::uintmax_t>(filled + kBlock, most_bytes + 1)));
    const size_t count = in.read(bytes.data() + filled, bytes.size() - filled);
    filled += count;
    if (filled > most_bytes) refuse_file_size(file, most_bytes);
    if (count > 0) continue;
    bytes.resize(filled);
    return bytes;
  }
}

}  // namespace

std::string read_file_bytes(const std::filesystem::path& file, std::uintmax_t most_bytes) {
  return reading(file, [&] { return whole_file(file, most_bytes); });
}

int open_regular_file(const std::filesystem::path& file) {
  return FileBytes(file).release();
}

void refuse_file_size(const std::filesystem::path& file, std::uintmax_t most_bytes) {
  throw InputError(
      file.string(), fmt::format("holds more than {} bytes", most_bytes),
      fmt::format("a file of {:.0f} MB at most", static_cast<double>(most_bytes) / 1e6),
      "docs/formats.md lists what each format may hold");
}

}  // namespace clothfit
