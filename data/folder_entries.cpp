#include "data/folder_entries.h"

#include <algorithm>
#include <system_error>

#include "data/input_error.h"

namespace clothfit {

std::vector<std::filesystem::path> folder_entries(const std::filesystem::path& folder) {
  std::error_code error;
  std::vector<std::filesystem::path> entries;
  for (std::filesystem::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error))
    entries.push_back(entry->path());
  if (error)
    throw InputError(folder.string(), "cannot be read: " + error.message(), "a readable folder",
                     "check the path and its permissions");
  std::ranges::sort(entries);
  return entries;
}

}  // namespace clothfit
