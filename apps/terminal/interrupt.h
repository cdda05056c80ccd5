#pragma once

#include <filesystem>
#include <mutex>

namespace clothfit {

/// Makes Ctrl-C (SIGINT) and SIGTERM set a flag from here on instead of killing the program. The
/// call at work can then end cleanly. The program ends with kExitCancelled at a second one of a
/// kind, half a second later or more, and kLongestEnding_ms after SIGTERM, wherever it is. What it
/// had not published is removed then (PartialFolder).
void catch_interrupts();

/// After SIGTERM a clean end has this long. Who sends it kills some seconds later.
inline constexpr int kLongestEnding_ms = 900;

/// Says whether one arrived. Progress callbacks return the opposite.
bool interrupted();

/// Says whether SIGTERM arrived: there is no time to make results of what was found.
bool terminated();

/// A folder to remove where the program ends wherever it is. One thread may keep several.
class PartialFolder {
 public:
  explicit PartialFolder(std::filesystem::path folder);
  ~PartialFolder();
  PartialFolder(const PartialFolder&) = delete;
  PartialFolder& operator=(const PartialFolder&) = delete;

  /// While this lives no folder is removed, so that one can be moved into place whole. A program
  /// that is ending waits for it a little, then leaves the folders as they are.
  static std::unique_lock<std::timed_mutex> keep_whole();

 private:
  std::filesystem::path folder_;
};

}  // namespace clothfit
