#pragma once

#include <filesystem>
#include <vector>

namespace clothfit {

/// A result folder that appears whole or not at all. Files are written into a hidden folder beside
/// it, which `publish` syncs to disk and renames. Without `publish` the destructor removes what was
/// written and leaves an older result as it was.
class OutputFolder {
 public:
  /// `inputs` are the files and folders that this run reads, and files that it keeps elsewhere.
  /// Throws InputError when the parent does not exist or cannot be written. Throws it also when
  /// `final_path` exists but no earlier run of this program published it, which a file named
  /// `.clothfit` shows, and when it holds an input: nothing of the user's is ever replaced.
  OutputFolder(const std::filesystem::path& final_path,
               const std::vector<std::filesystem::path>& inputs);
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

  /// Returns the folder to write to.
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
