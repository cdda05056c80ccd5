#include "data/partial_path.h"

#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <cerrno>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "data/number_text.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

std::string partial_prefix(const fs::path& final_path) {
  return fmt::format(".{}.partial-", final_path.filename().string());
}

std::string partial_ending(const fs::path& final_path) {
  return final_path.extension() == ".gz" ? ".gz" : "";
}

/// Says whether no process bears a number any more. A path with our own number is left from an
/// earlier process of that number.
bool is_dead(int process) {
  return process == getpid() || (kill(process, 0) != 0 && errno == ESRCH);
}

}  // namespace

fs::path partial_path(const fs::path& final_path) {
  return final_path.parent_path() /
         fmt::format("{}{}{}", partial_prefix(final_path), getpid(), partial_ending(final_path));
}

void remove_stale_partials(const fs::path& final_path) {
  const std::string prefix = partial_prefix(final_path), ending = partial_ending(final_path);
  std::error_code error;
  std::vector<fs::path> stale;
  for (fs::directory_iterator entry(final_path.parent_path(), error), end; !error && entry != end;
       entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    if (!name.starts_with(prefix) || !name.ends_with(ending)) continue;
    std::string_view number(name);
    number.remove_prefix(prefix.size());
    number.remove_suffix(std::min(ending.size(), number.size()));
    const std::optional<int> owner = parse_whole_number(number);
    if (owner && *owner > 0 && is_dead(*owner)) stale.push_back(entry->path());
  }
  for (const fs::path& path : stale) fs::remove_all(path, error);
}

}  // namespace clothfit
