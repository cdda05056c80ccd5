#include "apps/study/recordings/recordings_checksum.h"

#include <set>
#include <string_view>
#include <system_error>

#include "data/folder_entries.h"
#include "data/text_file.h"
#include "fit/jobs/checksum.h"

namespace clothfit {

namespace fs = std::filesystem;

namespace {

/// Adds the files below a folder, each folder that links lead to once. A link that leads
/// nowhere is the fit's to refuse, where it is needed.
void add_files_below(const fs::path& folder, std::set<fs::path>& walked,
                     std::set<fs::path>& files) {
  std::error_code error;
  const fs::path itself = fs::canonical(folder, error);
  if (!error && !walked.insert(itself).second) return;
  for (const FolderEntry& entry : list_folder(folder)) {
    if (entry.kind == FolderEntry::Kind::file) files.insert(entry.path);
    if (entry.kind == FolderEntry::Kind::folder) add_files_below(entry.path, walked, files);
  }
}

}  // namespace

std::uint64_t checksum_of_text(const std::string& text, std::uint64_t before) {
  return checksum(std::string_view("\0", 1), checksum(text, before));
}

std::uint64_t recordings_checksum(const std::vector<fs::path>& recordings) {
  std::uint64_t sum = kEmptyChecksum;
  const auto add = [&](const std::string& text) { sum = checksum_of_text(text, sum); };
  for (const fs::path& folder : recordings) {
    add(folder.generic_string());
    std::set<fs::path> walked, files;
    add_files_below(folder, walked, files);
    for (const fs::path& file : files) {
      add(file.lexically_relative(folder).generic_string());
      std::error_code error;
      add(std::to_string(fs::file_size(file, error)));
    }
    add(read_text(folder / kRecordingFile));
  }
  return sum;
}

}  // namespace clothfit
