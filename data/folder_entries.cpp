#include "data/folder_entries.h"

#include <algorithm>
#include <system_error>

#include "data/input_error.h"

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

}  // namespace

std::vector<FolderEntry> list_folder(const fs::path& folder) {
  std::error_code error;
  std::vector<fs::path> paths;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error))
    if (!entry->path().filename().string().starts_with(".")) paths.push_back(entry->path());
  if (error)
    throw InputError(folder.string(), "the folder cannot be listed: " + error.message(),
                     "a readable folder", "give yourself the right to read it, or copy it");
  std::ranges::sort(paths);
  std::vector<FolderEntry> entries;
  for (const fs::path& path : paths) entries.push_back(look_up(path));
  return entries;
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
