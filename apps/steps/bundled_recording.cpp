#include "apps/steps/bundled_recording.h"

#include <system_error>

#include "data/input_error.h"

namespace clothfit {

namespace fs = std::filesystem;

namespace {

/// Returns a path below the data that come with the program.
fs::path bundled(const fs::path& path, const std::string& what, const std::string& remedy) {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (!error) {
    const fs::path installed = program.parent_path().parent_path() / "share" / "clothfit" / path;
    if (fs::exists(installed)) return installed;
  }
  const fs::path source = fs::path(CLOTHFIT_SOURCE_DATA) / path;
  if (fs::exists(source)) return source;
  throw InputError(source.string(), "the bundled " + what + " is not there",
                   "looked for in the source tree, or in share/clothfit beside the program",
                   remedy);
}

}  // namespace

std::filesystem::path bundled_recording(const std::string& name) {
  return bundled(fs::path("recordings") / name / "recording.yaml", "recording",
                 "install again, or name a recording: clothfit fit RECORDING")
      .parent_path();
}

std::filesystem::path bundled_pattern(const std::string& name) {
  return bundled(fs::path("patterns") / (name + ".yaml"), "pattern",
                 "install again, or name a pattern: clothfit drape PATTERN");
}

}  // namespace clothfit
