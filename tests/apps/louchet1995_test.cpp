// Runs `clothfit experiment louchet1995 --quick` from outside. Checks its files, and that neither
// threads nor an interruption change them. Its numbers:
// tests/apps/study/louchet1995/paper_problem_test.cpp. The look of the page is for a person to
// judge.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <string>

#include "tests/apps/program_run.h"
#include "tests/apps/scratch_folder.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;
using test::names_in;
using test::ProgramRun;
using test::run_program;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

std::string text_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Reads every file but the one that holds seconds; in the page they are blanked.
std::map<std::string, std::string> results_in(const fs::path& folder) {
  const std::regex measured("<span class=\"measured\">[^<]*</span>");
  std::map<std::string, std::string> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    if (entry.path().filename() != "timing.csv")
      files[entry.path().filename()] = std::regex_replace(text_of(entry.path()), measured, "");
  return files;
}

ProgramRun run(const fs::path& folder, std::vector<std::string> options) {
  options.insert(options.begin(), {"experiment", "louchet1995", "--quick", "--seeds", "1"});
  return run_program(options, folder);
}

TEST(Louchet1995Experiment, LeavesTheSameForAnyThreadsAndAfterAnInterruption) {
  const test::ScratchFolder here("louchet1995");
  const ProgramRun one =
      run(here.path(), {"--threads", "1", "--out", "one", "--journal", "kept.journal"});
  ASSERT_EQ(one.exit_code, 0) << one.error;
  const ProgramRun two = run(here.path(), {"--threads", "2", "--out", "two"});
  ASSERT_EQ(two.exit_code, 0) << two.error;
  EXPECT_THAT(names_in(here.path()), ElementsAre("kept.journal", "one", "two"));

  const auto expected = results_in(here.path() / "one");
  EXPECT_EQ(expected.size(), 14u);  // 12 tables, the page, the folder's mark
  EXPECT_THAT(expected.at("report.html"), HasSubstr("QUICK"));
  EXPECT_THAT(expected.at("report.html"), Not(HasSubstr("nan")));
  EXPECT_EQ(results_in(here.path() / "two"), expected);

  // A kill leaves a journal like this, cut in the middle of a record.
  EXPECT_EQ(run(here.path(), {"--out", "three", "--journal", "kept.journal"}).exit_code, 3);
  fs::resize_file(here.path() / "kept.journal", fs::file_size(here.path() / "kept.journal") / 2);
  const ProgramRun resumed =
      run(here.path(), {"--out", "three", "--journal", "kept.journal", "--resume"});
  ASSERT_EQ(resumed.exit_code, 0) << resumed.error;
  EXPECT_EQ(results_in(here.path() / "three"), expected);
}

TEST(Louchet1995Experiment, RefusesWhatItDoesNotKnow) {
  const test::ScratchFolder here("louchet1995_refused");
  EXPECT_EQ(run_program({"experiment", "provot1995"}, here.path()).exit_code, 2);
  EXPECT_EQ(run_program({"experiment"}, here.path()).exit_code, 2);
  EXPECT_EQ(run_program({"experiment", "louchet1995", "--seeds", "0"}, here.path()).exit_code, 3);
  EXPECT_THAT(names_in(here.path()), ElementsAre());
}

}  // namespace
}  // namespace clothfit
