#include "tests/faults/faulty_run.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <regex>

namespace clothfit::test {
namespace {

namespace fs = std::filesystem;

/// Returns a file's bytes without the time at which it ran and the seconds that it took.
std::string bytes_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  const std::string extension = file.extension();
  if (extension == ".pdf")
    return std::regex_replace(bytes, std::regex(R"(/CreationDate \([^)]*\))"), "");
  if (extension != ".json" && extension != ".html") return bytes;
  static const std::regex seconds(
      R"("seconds": [0-9.e+-]+|[0-9.e+-]+ s</p>|data-name="(median|longest) s" class="number">[^<]*)");
  return std::regex_replace(bytes, seconds, "");
}

std::map<std::string, std::string> files_below(const fs::path& folder) {
  std::map<std::string, std::string> files;
  if (!fs::exists(folder)) return files;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    files[fs::relative(entry.path(), folder)] =
        entry.is_regular_file() ? bytes_of(entry.path()) : "";
  return files;
}

std::string names_of(const std::map<std::string, std::string>& files) {
  std::string names;
  for (const auto& [name, bytes] : files) names += name + " ";
  return names;
}

}  // namespace

const std::vector<FaultKind>& fault_kinds() {
  static const std::vector<FaultKind> kinds = {
      {"open_write", EACCES}, {"open_read", EACCES}, {"open_folder", EACCES}, {"list", EIO, 7},
      {"read", EIO},          {"write", ENOSPC},     {"sync", EIO},           {"close", EIO},
      {"rename", EIO},        {"exchange", EIO},     {"mkdir", ENOSPC},       {"remove", EACCES},
      {"cut", EIO},           {"copy", ENOSPC},      {"look", EACCES}};
  return kinds;
}

FaultyRuns::FaultyRuns(const FaultyCommand& command)
    : command_(command),
      root_(fs::temp_directory_path() /
            ("clothfit_faults_" + command.name + "_" + std::to_string(getpid()))),
      here_(root_ / "run"),
      log_(root_ / "log") {
  fs::remove_all(root_);
  fs::create_directories(root_ / "inputs");
  command_.prepare(root_ / "inputs");
  inputs_ = files_below(root_ / "inputs");
  lay_out(true);
  older_ = files_below(here_ / "out");
  const ProgramRun done = run("", &calls_);
  EXPECT_EQ(done.exit_code, 0) << done.error;
  whole_ = files_below(here_ / "out");
}

FaultyRuns::~FaultyRuns() {
  std::error_code ignored;
  fs::remove_all(root_, ignored);
}

void FaultyRuns::lay_out(bool older) const {
  fs::remove_all(here_);
  fs::copy(root_ / "inputs", here_, fs::copy_options::recursive);
  if (!older || !command_.writes || !command_.replaces) return;
  fs::create_directories(here_ / "out" / "folder");
  for (const char* name : {".clothfit", "older.txt", "folder/older.txt"})
    std::ofstream(here_ / "out" / name) << "older";
}

ProgramRun FaultyRuns::run(const std::string& fault, std::map<std::string, int>* calls,
                           bool resume) {
  std::vector<std::string> words = command_.words;
  if (command_.writes) words.insert(words.end(), {"--out", "out"});
  if (resume) words.emplace_back("--resume");
  fs::remove(log_);
  setenv("LD_PRELOAD", CLOTHFIT_FAIL_ONCE, 1);
  setenv("CLOTHFIT_FAULT", fault.c_str(), 1);
  setenv("CLOTHFIT_FAULT_FOLDER", here_.c_str(), 1);
  setenv("CLOTHFIT_FAULT_LOG", log_.c_str(), 1);
  const ProgramRun done = run_program(words, here_);
  unsetenv("LD_PRELOAD");
  failed_path_.clear();
  std::ifstream log(log_);
  for (std::string what, kind; log >> what >> kind;) {
    if (what == "count") {
      int count = 0;
      log >> count;
      if (calls) (*calls)[kind] = count;
    } else {
      log.ignore(1);
      std::getline(log, failed_path_);
    }
  }
  return done;
}

void FaultyRuns::expect_honest(const Fault& fault, bool older) {
  lay_out(older);
  const std::string one = fault.kind.name + ":" + std::to_string(fault.number) +
                          (fault.stays ? "+:" : ":") + std::to_string(fault.kind.error_number);
  const ProgramRun done = run(fault.also.empty() ? one : one + "," + fault.also, nullptr);
  const std::string failed_path = failed_path_;
  SCOPED_TRACE(command_.name + " " + one + (older ? " " : " without an older result ") +
               failed_path + "\nexit code " + std::to_string(done.exit_code) + "\n" + done.error);
  EXPECT_NE(failed_path, "") << "the call was not made";
  judge(done, older, fault);
}

void FaultyRuns::judge(const ProgramRun& done, bool older, const Fault& fault) {
  EXPECT_TRUE(done.exit_code == 0 || done.exit_code == 3);
  Files out = files_below(here_ / "out");
  if (!command_.replaces) out.erase(".clothfit");  // it is removed last of all
  const bool is_whole = out == whole_, is_older = out == (older ? older_ : Files());
  EXPECT_TRUE(is_whole || is_older) << names_of(out);
  if (done.exit_code == 0) {
    EXPECT_TRUE(is_whole) << names_of(out);
  } else {
    judge_message(done);
  }
  for (const auto& [name, bytes] : inputs_)
    EXPECT_TRUE(fs::is_directory(here_ / name) || bytes_of(here_ / name) == bytes) << name;

  const bool cannot_remove = fault.kind.name == "remove" || fault.kind.name == "list" ||
                             fault.kind.name == "open_folder" || fault.kind.name == "look";
  if (!cannot_remove) {
    EXPECT_THAT(hidden_names(), ::testing::IsEmpty());
  }
  const bool resumes = done.exit_code != 0 && !command_.kept.empty();
  if (resumes || !hidden_names().empty()) judge_resumed();
}

void FaultyRuns::judge_message(const ProgramRun& done) const {
  // A folder is synced for the sake of what lies in it, and a result as a whole.
  const fs::path failed = failed_path_;
  const std::string first = *failed.lexically_relative(here_).begin();
  bool names_it = false;
  for (const std::string& name :
       {failed.filename().string(), failed.parent_path().filename().string(), command_.kept,
        first.starts_with(".out.") ? first : ""})
    names_it = names_it || (!name.empty() && done.error.find(name) != std::string::npos);
  EXPECT_TRUE(names_it) << "the message names another file";
}

void FaultyRuns::judge_resumed() {
  const bool resume = !command_.kept.empty() && fs::exists(here_ / command_.kept);
  const ProgramRun again = run("", nullptr, resume);
  EXPECT_EQ(again.exit_code, 0) << "the run after it: " << again.error;
  EXPECT_TRUE(files_below(here_ / "out") == whole_) << "the run after it left another result";
  EXPECT_THAT(hidden_names(), ::testing::IsEmpty()) << "after the run after it";
}

std::vector<std::string> FaultyRuns::hidden_names() const {
  std::vector<std::string> hidden;
  for (const std::string& name : names_in(here_))
    if (name.starts_with(".")) hidden.push_back(name);
  return hidden;
}

}  // namespace clothfit::test
