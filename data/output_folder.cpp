#include "data/output_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <stdio.h>
#include <unistd.h>

#include <cassert>
#include <cerrno>
#include <cstring>
#include <string>

#include "data/input_error.h"
#include "data/partial_path.h"
#include "data/sync_to_disk.h"
#include "data/text_file.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPublishedMark = ".clothfit";

/// Follows a link: the folder that it points to is replaced, never the link.
fs::path resolved(const fs::path& given) {
  std::error_code error;
  fs::path path = fs::weakly_canonical(fs::absolute(given), error);
  if (error) path = fs::absolute(given).lexically_normal();
  if (!path.has_filename()) path = path.parent_path();
  return path;
}

void require_replaceable(const fs::path& final_path) {
  std::error_code error;
  const fs::file_status status = fs::symlink_status(final_path, error);
  if (!fs::exists(status)) return;
  if (!fs::is_directory(status))
    throw InputError(final_path.string(), "exists and is not a folder", "a folder to write to",
                     "name another folder");
  if (!fs::exists(final_path / kPublishedMark, error))
    throw InputError(final_path.string(), "exists and was not written by clothfit",
                     "a new folder or an older result",
                     "name another folder, or move that folder away");
}

/// Refuses to replace a folder in which an input lies, through links or not.
void require_holds_no_input(const fs::path& final_path, const std::vector<fs::path>& inputs) {
  std::error_code error;
  if (!fs::exists(final_path, error)) return;
  for (const fs::path& input : inputs) {
    if (input.empty()) continue;
    for (const fs::path& path : {resolved(input), fs::absolute(input).lexically_normal()}) {
      const fs::path inside = path.lexically_relative(final_path);
      if (inside.empty() || *inside.begin() == "..") continue;
      throw InputError(final_path.string(), "holds " + path.string() + ", which this run reads",
                       "a folder for the results that holds no input", "name another folder");
    }
  }
}

[[noreturn]] void refuse(const fs::path& path, const std::string& what, int error_number) {
  throw InputError(path.string(), what + ": " + std::strerror(error_number),
                   "a writable folder with room on its disk", "name another folder");
}

void sync(const fs::path& path) {
  if (const int error_number = sync_to_disk(path)) refuse(path, "cannot be synced", error_number);
}

void sync_tree(const fs::path& folder) {
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_symlink()) continue;
    if (entry.is_regular_file() || entry.is_directory()) sync(entry.path());
  }
  sync(folder);
}

/// Swaps two folders in one step, or in two where the file system cannot swap.
bool exchange(const fs::path& a, const fs::path& b) {
  if (renameat2(AT_FDCWD, a.c_str(), AT_FDCWD, b.c_str(), RENAME_EXCHANGE) == 0) return true;
  if (errno != EINVAL && errno != ENOSYS) return false;
  const fs::path aside =
      b.parent_path() / fmt::format(".{}.replaced-{}", b.filename().string(), getpid());
  if (rename(b.c_str(), aside.c_str()) != 0) return false;
  if (rename(a.c_str(), b.c_str()) != 0) {
    const int error_number = errno;
    static_cast<void>(rename(aside.c_str(), b.c_str()));
    errno = error_number;
    return false;
  }
  // The new result is in place; the older one is only to be removed, from wherever it lies.
  std::error_code ignored;
  if (rename(aside.c_str(), a.c_str()) != 0) fs::remove_all(aside, ignored);
  return true;
}

/// Moves a folder to a free place.
bool move_to_free(const fs::path& from, const fs::path& to) {
  if (renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return true;
  if (errno != EINVAL && errno != ENOSYS) return false;
  return rename(from.c_str(), to.c_str()) == 0;
}

}  // namespace

OutputFolder::OutputFolder(const fs::path& final_path, const std::vector<fs::path>& inputs) {
  if (final_path.empty())
    throw InputError("folder for the results", "the name is empty", "the name of a folder");
  final_path_ = resolved(final_path);
  const fs::path parent = final_path_.parent_path();
  std::error_code error;
  if (!fs::is_directory(parent, error))
    throw InputError(final_path.string(), "the folder " + parent.string() + " does not exist",
                     "an existing folder to write into",
                     "create it: mkdir -p '" + parent.string() + "'");
  require_replaceable(final_path_);
  require_holds_no_input(final_path_, inputs);
  remove_stale_partials(final_path_);
  work_path_ = partial_path(final_path_);
  if (!fs::create_directory(work_path_, error))
    refuse(work_path_, "cannot be created", error ? error.value() : EEXIST);
}

OutputFolder::~OutputFolder() {
  // Once published, an older result may lie there.
  std::error_code error;
  fs::remove_all(work_path_, error);
}

void OutputFolder::publish() {
  assert(!published_);
  write_text("Written by clothfit; a later run that writes here replaces this folder.\n",
             work_path_ / kPublishedMark);
  try {
    sync_tree(work_path_);
  } catch (const fs::filesystem_error& error) {
    refuse(work_path_, "cannot be synced", error.code().value());
  }
  require_replaceable(final_path_);
  std::error_code error;
  const bool replaces = fs::exists(fs::symlink_status(final_path_, error));
  const bool moved =
      replaces ? exchange(work_path_, final_path_) : move_to_free(work_path_, final_path_);
  if (!moved) refuse(final_path_, "cannot be put in place", errno);
  published_ = true;
  sync(final_path_.parent_path());
  if (replaces) fs::remove_all(work_path_, error);
}

}  // namespace clothfit
