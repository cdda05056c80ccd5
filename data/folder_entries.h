#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace clothfit {

/// A name in a folder, and what it leads to.
struct FolderEntry {
  std::filesystem::path path;
  enum class Kind { file, folder, other } kind = Kind::other;
  std::string other;  ///< what it is that is neither: "is a link that leads nowhere"
};

/// Lists a folder in the order of its names, links followed. Names that begin with a dot are left
/// out: systems lay such companions beside files. Throws InputError with the system's reason.
std::vector<FolderEntry> list_folder(const std::filesystem::path& folder);

/// Lists as `list_folder` does, and refuses what is neither a file nor a folder.
std::vector<FolderEntry> list_whole_folder(const std::filesystem::path& folder);

/// Refuses an entry for what it leads to.
[[noreturn]] void refuse_entry(const FolderEntry& entry, const std::string& expected);

}  // namespace clothfit
