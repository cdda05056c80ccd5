#include "apps/study/recordings/recordings_checksum.h"

#include <set>
#include <string_view>

#include "data/text_file.h"
#include "fit/jobs/checksum.h"

namespace clothfit {

namespace fs = std::filesystem;

std::uint64_t checksum_of_text(const std::string& text, std::uint64_t before) {
  return checksum(std::string_view("\0", 1), checksum(text, before));
}

std::uint64_t recordings_checksum(const std::vector<fs::path>& recordings) {
  std::uint64_t sum = kEmptyChecksum;
  const auto add = [&](const std::string& text) { sum = checksum_of_text(text, sum); };
  for (const fs::path& folder : recordings) {
    add(folder.generic_string());
    std::set<fs::path> files;
    for (const auto& entry : fs::recursive_directory_iterator(folder))
      if (entry.is_regular_file()) files.insert(entry.path());
    for (const fs::path& file : files) {
      add(file.lexically_relative(folder).generic_string());
      add(std::to_string(fs::file_size(file)));
    }
    add(read_text(folder / kRecordingFile));
  }
  return sum;
}

}  // namespace clothfit
