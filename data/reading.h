#pragma once

#include <filesystem>
#include <new>
#include <stdexcept>

#include "data/unreadable_file.h"

namespace clothfit {

/// Returns `read()`. Where memory runs out or the file system fails meanwhile, throws an
/// UnreadableFile that names `file`.
template <class Read>
auto reading(const std::filesystem::path& file, Read read) -> decltype(read()) {
  const char* const remedy = "docs/formats.md lists what each format may hold";
  try {
    return read();
  } catch (const std::bad_alloc&) {
    throw UnreadableFile(file.string(), "needs more memory than there is", "a smaller file",
                         remedy);
  } catch (const std::length_error&) {
    throw InputError(file.string(), "is too long", "a smaller file", remedy);
  } catch (const std::filesystem::filesystem_error& error) {
    const std::filesystem::path& named = error.path1().empty() ? file : error.path1();
    throw UnreadableFile(named.string(), "cannot be read: " + error.code().message(),
                         "a readable file or folder");
  }
}

}  // namespace clothfit
