#include "apps/steps/bundled_recording.h"

#include <system_error>

#include "data/input_error.h"

namespace clothfit {

namespace fs = std::filesystem;

std::filesystem::path bundled_recording(const std::string& name) {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (!error) {
    const fs::path installed =
        program.parent_path().parent_path() / "share" / "clothfit" / "recordings" / name;
    if (fs::exists(installed / "recording.yaml")) return installed;
  }
  const fs::path source = fs::path(CLOTHFIT_SOURCE_RECORDINGS) / name;
  if (fs::exists(source / "recording.yaml")) return source;
  throw InputError(
      source.string(), "the bundled recording is not there",
      "looked for in the source tree, or in share/clothfit/recordings beside the program",
      "install again, or name a recording: clothfit fit RECORDING");
}

}  // namespace clothfit
