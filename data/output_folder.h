#pragma once

#include <filesystem>

namespace clothfit {

/// A result folder that appears whole or not at all: files are written into a hidden folder beside
/// it, synced to disk and renamed by `publish`. A destructor without `publish` removes what was
/// written and leaves an older result as it was.
class OutputFolder {
 public:
  /// Throws InputError when the parent does not exist or cannot be written, or when `final_path`
  /// exists and is not a folder that an earlier run of this program published (a file named
  /// `.clothfit` marks those): nothing of the user's is ever replaced.
  explicit OutputFolder(std::filesystem::path final_path);
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

  /// Where to write.
  const std::filesystem::path& path() const { return work_path_; }
  const std::filesystem::path& final_path() const { return final_path_; }

  /// Syncs and moves the folder into place; an older result is replaced in one rename.
  void publish();

 private:
  std::filesystem::path final_path_;
  std::filesystem::path work_path_;
  bool published_ = false;
};

}  // namespace clothfit
