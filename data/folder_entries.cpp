#include "data/folder_entries.h"

#include <dirent.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>
#include <string>
#include <system_error>

#include "data/input_error.h"
#include "data/reading.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

FolderEntry look_up(const fs::path& path) {
  std::error_code error;
  const fs::file_type type = fs::status(path, error).type();
  using Kind = FolderEntry::Kind;
  switch (type) {
    case fs::file_type::regular:
      return {.path = path, .kind = Kind::file, .other = {}};
    case fs::file_type::directory:
      return {.path = path, .kind = Kind::folder, .other = {}};
    case fs::file_type::fifo:
      return {.path = path, .other = "is a named pipe"};
    case fs::file_type::socket:
      return {.path = path, .other = "is a socket"};
    case fs::file_type::block:
    case fs::file_type::character:
      return {.path = path, .other = "is a device"};
    case fs::file_type::not_found:
      return {.path = path, .other = "is a link that leads nowhere"};
    default:
      return {.path = path, .other = "cannot be looked at: " + error.message()};
  }
}

[[noreturn]] void refuse_listing(const fs::path& folder, int error_number) {
  throw InputError(folder.string(),
                   std::string("the folder cannot be listed: ") + std::strerror(error_number),
                   "a readable folder", "give yourself the right to read it, or copy it");
}

std::vector<FolderEntry> sorted_entries(const fs::path& folder) {
  // libstdc++'s directory_iterator ends the program where memory runs out.
  const std::unique_ptr<DIR, int (*)(DIR*)> listed(opendir(folder.c_str()), closedir);
  if (!listed) refuse_listing(folder, errno);
  std::vector<fs::path> paths;
  for (;;) {
    errno = 0;
    const dirent* const entry = readdir(listed.get());
    if (entry == nullptr && errno != 0) refuse_listing(folder, errno);
    if (entry == nullptr) break;
    if (entry->d_name[0] != '.') paths.push_back(folder / entry->d_name);
  }
  std::ranges::sort(paths);
  std::vector<FolderEntry> entries;
  for (const fs::path& path : paths) entries.push_back(look_up(path));
  return entries;
}

}  // namespace

std::vector<FolderEntry> list_folder(const fs::path& folder) {
  return reading(folder, [&] { return sorted_entries(folder); });
}

std::vector<FolderEntry> list_whole_folder(const fs::path& folder) {
  std::vector<FolderEntry> entries = list_folder(folder);
  for (const FolderEntry& entry : entries)
    if (entry.kind == FolderEntry::Kind::other) refuse_entry(entry, "a file or a folder");
  return entries;
}

void refuse_entry(const FolderEntry& entry, const std::string& expected) {
  const bool folder = entry.kind == FolderEntry::Kind::folder;
  throw InputError(entry.path.string(), folder ? "is a folder" : entry.other, expected,
                   folder ? "move it elsewhere" : "put the file there itself, or remove the name");
}

}  // namespace clothfit
