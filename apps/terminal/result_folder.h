#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "apps/terminal/interrupt.h"
#include "data/output_folder.h"

namespace clothfit {

/// A result folder (data/output_folder.h) that leaves nothing behind where the program is ended at
/// once either (apps/terminal/interrupt.h).
class ResultFolder {
 public:
  /// Throws InputError as OutputFolder does.
  ResultFolder(const std::filesystem::path& final_path,
               const std::vector<std::filesystem::path>& inputs)
      : folder_(final_path, inputs) {
    partial_.emplace(folder_.path());
  }

  /// Returns the folder to write to.
  const std::filesystem::path& path() const { return folder_.path(); }
  const std::filesystem::path& final_path() const { return folder_.final_path(); }

  /// Moves the folder into place, whole.
  void publish() {
    {
      const auto lock = PartialFolder::keep_whole();
      folder_.publish();
    }
    partial_.reset();
  }

 private:
  std::optional<PartialFolder> partial_;  ///< goes after the folder
  OutputFolder folder_;
};

}  // namespace clothfit
