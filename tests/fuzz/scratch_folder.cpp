#include "tests/fuzz/scratch_folder.h"

#include <stdlib.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <stdexcept>

#include "data/text_file.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kMark = "=== ";
constexpr size_t kMostFiles = 24;

class ScratchFolder {
 public:
  ScratchFolder() {
    std::string name = (fs::temp_directory_path() / "clothfit-fuzz-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no folder for " + name);
    path_ = name;
  }
  ~ScratchFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

bool can_be_written(std::string_view name) {
  constexpr std::string_view kLetters =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._-/";
  return !name.empty() && name.size() < 64 && name.front() != '/' && name.back() != '/' &&
         name.find("..") == std::string_view::npos && name.find("//") == std::string_view::npos &&
         name.find_first_not_of(kLetters) == std::string_view::npos;
}

}  // namespace

const fs::path& scratch_folder() {
  static const ScratchFolder folder;
  return folder.path();
}

fs::path write_scratch(std::string_view name, std::string_view bytes) {
  const fs::path file = scratch_folder() / name;
  std::ofstream(file, std::ios::binary)
      .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  return file;
}

std::map<std::string, std::string> files_of(std::string_view input, const std::string& first) {
  std::map<std::string, std::string> files;
  std::string name = first;
  std::string_view rest = input;
  while (true) {
    size_t end = rest.starts_with(kMark) ? 0 : rest.find("\n=== ");
    if (end != 0) end = std::min(end, rest.size() - 1) + 1;  // the line's end is the file's
    if (rest.empty()) end = 0;
    if (can_be_written(name) && files.size() < kMostFiles && (end > 0 || name != first))
      files.try_emplace(name, rest.substr(0, end));
    rest.remove_prefix(end);
    if (rest.empty()) return files;
    const size_t line = std::min(rest.find('\n'), rest.size());
    name = rest.substr(kMark.size(), line - kMark.size());
    rest.remove_prefix(std::min(line + 1, rest.size()));
  }
}

const fs::path& write_files(const std::map<std::string, std::string>& files) {
  const fs::path& folder = scratch_folder();
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    fs::remove_all(entry.path());
  for (const auto& [name, text] : files) {
    std::error_code error;  // a file may stand where another needs a folder
    fs::create_directories((folder / name).parent_path(), error);
    if (error || fs::is_directory(folder / name)) continue;
    if (name.ends_with(".gz"))
      write_text(text, folder / name);
    else
      write_scratch(name, text);
  }
  return folder;
}

}  // namespace clothfit
