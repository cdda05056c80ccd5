// From pictures to the report, the same bytes: whatever the threads, the heap, the addresses, the
// instruction sets of OpenCV and of the C library, the BLAS, the locale and the user. The
// program's own instruction sets are compared kernel by kernel (tests/vision/detect,
// tests/model/kernels, tests/model/integrate): nothing outside the program picks them. Dots,
// textures, videos, starts in motion, searches to their end and diagnoses are not run here. Nor is
// another processor: where two of them differ is said in docs/conventions.md.

#include <gtest/gtest.h>
#include <sys/personality.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <regex>
#include <string>
#include <utility>
#include <vector>

#include "tests/apps/bundled_recordings.h"
#include "tests/apps/program_run.h"
#include "tests/apps/scratch_folder.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;
using test::ProgramRun;
using test::run_program;

/// Changes the environment of programs that are run while it lives.
class Environment {
 public:
  explicit Environment(const std::vector<std::pair<std::string, std::string>>& variables) {
    for (const auto& [name, value] : variables) {
      const char* now = std::getenv(name.c_str());
      before_.emplace_back(name, now ? std::optional<std::string>(now) : std::nullopt);
      setenv(name.c_str(), value.c_str(), 1);
    }
  }
  ~Environment() {
    for (const auto& [name, value] : before_)
      if (value)
        setenv(name.c_str(), value->c_str(), 1);
      else
        unsetenv(name.c_str());
  }
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;

 private:
  std::vector<std::pair<std::string, std::optional<std::string>>> before_;
};

/// Puts programs that are run while it lives at the same addresses each time.
class FixedAddresses {
 public:
  explicit FixedAddresses(bool fixed) : before_(personality(kAsk)) {
    if (fixed) personality(static_cast<unsigned long>(before_) | ADDR_NO_RANDOMIZE);
  }
  ~FixedAddresses() { personality(static_cast<unsigned long>(before_)); }
  FixedAddresses(const FixedAddresses&) = delete;
  FixedAddresses& operator=(const FixedAddresses&) = delete;

 private:
  static constexpr unsigned long kAsk = 0xffffffff;
  int before_;
};

/// How the program is run.
struct Setting {
  std::string name;
  int threads = 1;
  std::vector<std::pair<std::string, std::string>> environment = {};
  bool fixed_addresses = false;
};

/// Returns what OpenCV can leave out on this processor. It prints a line for what is not there.
std::string opencv_instructions() {
  std::string names = "AVX";
  if (__builtin_cpu_supports("avx2")) names += ",AVX2,FP16";
  if (__builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq"))
    names += ",AVX512-SKX";
  return names;
}

std::vector<Setting> settings() {
  const std::string heap = "glibc.malloc.";
  std::vector<Setting> all{
      {.name = "three threads", .threads = 3},
      {.name = "a heap with fewer holes, another language, nobody's home",
       .threads = 2,
       .environment = {{"GLIBC_TUNABLES", heap + "tcache_count=0:" + heap + "top_pad=1000000"},
                       {"LC_ALL", "de_DE.UTF-8"},
                       {"LANG", "tr_TR.UTF-8"},
                       {"TZ", "Asia/Tokyo"},
                       {"HOME", "/nonexistent"}}},
      {.name = "blocks far apart that are not zero, fixed addresses",
       .environment = {{"GLIBC_TUNABLES", heap + "mmap_threshold=4096:" + heap + "mmap_max=60000:" +
                                              heap + "arena_max=1:" + heap + "perturb=85"}},
       .fixed_addresses = true},
      // The C library keeps its own: its last bits may differ (docs/conventions.md).
      {.name = "without AVX in OpenCV",
       .environment = {{"OPENCV_CPU_DISABLE", opencv_instructions()}}}};
  // Debian keeps the reference BLAS beside the one that is chosen.
  const fs::path libraries = "/usr/lib/x86_64-linux-gnu";
  if (fs::exists(libraries / "blas") && fs::exists(libraries / "lapack"))
    all.push_back({.name = "the reference BLAS",
                   .environment = {{"LD_LIBRARY_PATH", (libraries / "blas").string() + ":" +
                                                           (libraries / "lapack").string()}}});
  return all;
}

/// Returns a file's bytes without the seconds that the run took.
std::string bytes_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(in), {}};
  if (file.filename() == "fit.json")
    return std::regex_replace(bytes, std::regex(R"("seconds": [0-9.e+-]+)"), "");
  if (file.filename() == "report.html")
    return std::regex_replace(bytes, std::regex("(seed [0-9]+ [^0-9<]+)[0-9.e+-]+ s</p>"), "$1");
  return bytes;
}

/// The bundled recording, cut to a few pictures of each kind.
fs::path short_recording(const fs::path& folder) {
  const fs::path few = folder / "tags_onecam";
  fs::copy(kBundled / "tags_onecam", few, fs::copy_options::recursive);
  for (const auto& [pictures, last] :
       {std::pair<const char*, const char*>{"frames/front", "000006.jpg"},
        {"calibration/front", "08.jpg"}})
    for (const auto& entry : fs::directory_iterator(few / pictures))
      if (entry.path().filename() > last) fs::remove(entry.path());
  std::ifstream in(few / "recording.yaml");
  std::string yaml{std::istreambuf_iterator<char>(in), {}};
  in.close();
  std::ofstream(few / "recording.yaml")
      << std::regex_replace(yaml, std::regex("from_frame: 50"), "from_frame: 5");
  return few;
}

/// Runs track, fit and simulate under a setting; returns what they print and the bytes of every
/// file that they leave.
std::map<std::string, std::string> results(const fs::path& recording, const fs::path& folder,
                                           const Setting& setting) {
  const Environment environment(setting.environment);
  const FixedAddresses addresses(setting.fixed_addresses);
  const std::string threads = std::to_string(setting.threads);
  fs::remove_all(folder);
  fs::create_directory(folder);
  std::map<std::string, std::string> found;
  const auto run = [&](std::vector<std::string> words) {
    const ProgramRun done = run_program(words, folder);
    EXPECT_EQ(done.exit_code, 0) << words[0] << ": " << done.error;
    found[words[0] + " prints"] = done.out + done.error;
  };
  run({"track", recording.string(), "--threads", threads, "--out", "tracks"});
  run({"fit", "tracks", "--population", "8", "--generations", "2", "--refine-best", "1", "--mesh",
       "9x9", "--work", "1e-4", "--keep", "--threads", threads, "--out", "fit"});
  run({"simulate", "--fit", "fit", "--format", "csv", "--out", "simulation"});
  for (const char* result : {"tracks", "fit", "simulation"})
    for (const auto& entry : fs::recursive_directory_iterator(folder / result))
      if (entry.is_regular_file())
        found[fs::relative(entry.path(), folder).string()] = bytes_of(entry.path());
  return found;
}

TEST(ProgramSameBytes, FromPicturesToTheReportWhateverRunsIt) {
  const test::ScratchFolder here("same_bytes");
  const fs::path recording = short_recording(here.path());
  // The results name the folders that they were made in, so all are made in one.
  const fs::path folder = here.path() / "run";
  const auto plain = results(recording, folder, {.name = "plain"});
  ASSERT_TRUE(plain.contains("tracks/tracks2d/front.csv"));
  ASSERT_TRUE(plain.contains("fit/report.html"));
  ASSERT_GT(plain.size(), 20u);

  for (const Setting& setting : settings()) {
    SCOPED_TRACE(setting.name);
    const auto other = results(recording, folder, setting);
    EXPECT_EQ(other.size(), plain.size());
    for (const auto& [name, bytes] : plain)
      EXPECT_TRUE(other.contains(name) && other.at(name) == bytes) << name;
  }
}

}  // namespace
}  // namespace clothfit
