// Checks that result folders appear whole or not at all. Not checked: that the data survive a loss
// of power. No test can pull the plug; the calls to fsync stand in output_folder.cpp.

#include "data/output_folder.h"

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <stdexcept>

#include "tests/data/expect_refused.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> names_in(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder))
    names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

/// Publishes a folder that holds one file.
void publish(const fs::path& final_path, const std::string& text) {
  OutputFolder out(final_path, {});
  write_text(text, out.path() / "fit.json");
  out.publish();
}

/// Returns a process number that nobody bears: that of a child which has ended and been waited for.
pid_t dead_process() {
  const pid_t child = fork();
  if (child == 0) _exit(0);
  waitpid(child, nullptr, 0);
  return child;
}

TEST(OutputFolder, AppearsOnlyWhenItIsPublished) {
  const TemporaryFolder folder;
  OutputFolder out(folder / "a.fit", {});

  write_text("{}", out.path() / "fit.json");
  fs::create_directories(out.path() / "steps" / "deep");
  write_text("x", out.path() / "steps" / "deep" / "file");

  EXPECT_FALSE(fs::exists(folder / "a.fit"));
  EXPECT_EQ(out.path().parent_path(), folder.path());
  EXPECT_EQ(out.path().filename().string(), ".a.fit.partial-" + std::to_string(getpid()));

  out.publish();

  EXPECT_EQ(names_in(folder.path()), std::vector<std::string>{"a.fit"});
  EXPECT_EQ(read_text(folder / "a.fit/steps/deep/file"), "x");
  EXPECT_TRUE(fs::exists(folder / "a.fit/.clothfit"));
}

TEST(OutputFolder, ThatFailsMidwayLeavesNothing) {
  const TemporaryFolder folder;
  try {
    OutputFolder out(folder / "a.fit", {});
    write_text("half", out.path() / "fit.json");
    throw std::runtime_error("midway");
  } catch (const std::runtime_error&) {
  }
  EXPECT_TRUE(names_in(folder.path()).empty());
}

TEST(OutputFolder, ThatFailsMidwayLeavesTheOlderResultIntact) {
  const TemporaryFolder folder;
  publish(folder / "a.fit", "old");
  try {
    OutputFolder out(folder / "a.fit", {});
    write_text("half", out.path() / "fit.json");
    throw std::runtime_error("midway");
  } catch (const std::runtime_error&) {
  }
  EXPECT_EQ(names_in(folder.path()), std::vector<std::string>{"a.fit"});
  EXPECT_EQ(read_text(folder / "a.fit/fit.json"), "old");
}

TEST(OutputFolder, ReplacesAnOlderResultWhole) {
  const TemporaryFolder folder;
  publish(folder / "a.fit", "old");
  write_text("of the old result", folder / "a.fit/extra");

  publish(folder / "a.fit", "new");

  EXPECT_EQ(names_in(folder.path()), std::vector<std::string>{"a.fit"});
  EXPECT_EQ(names_in(folder / "a.fit"), (std::vector<std::string>{".clothfit", "fit.json"}));
  EXPECT_EQ(read_text(folder / "a.fit/fit.json"), "new");
}

TEST(OutputFolder, NeverReplacesWhatTheProgramDidNotWrite) {
  const TemporaryFolder folder;
  folder.write("photos/mine.jpg", "mine");
  fs::create_directory(folder / "empty");
  folder.write("file", "mine");

  expect_refused(folder, "photos: exists and was not written by clothfit",
                 [&] { OutputFolder(folder / "photos", {}); });
  expect_refused(folder, "empty: exists and was not written by clothfit",
                 [&] { OutputFolder(folder / "empty", {}); });
  expect_refused(folder, "file: exists and is not a folder",
                 [&] { OutputFolder(folder / "file", {}); });

  EXPECT_EQ(names_in(folder.path()), (std::vector<std::string>{"empty", "file", "photos"}));
  EXPECT_EQ(read_text(folder / "photos/mine.jpg"), "mine");
}

TEST(OutputFolder, NeverReplacesWhatAppearedMeanwhile) {
  const TemporaryFolder folder;
  OutputFolder out(folder / "a.fit", {});
  folder.write("a.fit/mine", "mine");

  expect_refused(folder, "a.fit: exists and was not written by clothfit", [&] { out.publish(); });

  EXPECT_EQ(read_text(folder / "a.fit/mine"), "mine");
}

TEST(OutputFolder, NeverReplacesAFolderThatHoldsAnInput) {
  const TemporaryFolder folder;
  publish(folder / "old.fit", "old");
  folder.write("old.fit/steps/tracked/recording.yaml", "an input");
  fs::create_directory_symlink("old.fit/steps", folder / "link");

  const std::string refusal = "old.fit: holds " + (folder / "old.fit/steps/tracked").string();
  for (const fs::path& input : {folder / "old.fit/steps/tracked", folder / "link/tracked"})
    expect_refused(folder, refusal, [&] { OutputFolder(folder / "old.fit", {input}); });
  expect_refused(folder, "old.fit: holds " + (folder / "old.fit").string(), [&] {
    OutputFolder(folder / "old.fit", {"/elsewhere", folder / "old.fit"});
  });
  EXPECT_EQ(read_text(folder / "old.fit/steps/tracked/recording.yaml"), "an input");

  EXPECT_NO_THROW(OutputFolder(folder / "old.fit", {folder / "old.fitted", folder.path()}));
  EXPECT_NO_THROW(OutputFolder(folder / "new.fit", {folder / "new.fit/not/there"}));
}

TEST(OutputFolder, NeedsAFolderToStandIn) {
  const TemporaryFolder folder;
  folder.write("file", "");

  expect_refused(folder, "none/a.fit: the folder ",
                 [&] { OutputFolder(folder / "none/a.fit", {}); });
  expect_refused(folder, "file/a.fit: the folder ",
                 [&] { OutputFolder(folder / "file/a.fit", {}); });
  expect_refused(folder, "folder for the results: the name is empty",
                 [&] { OutputFolder(fs::path(), {}); });
}

TEST(OutputFolder, MayBeNamedRelativeToTheCurrentFolderOrWithASlashBehind) {
  const TemporaryFolder folder;
  const fs::path before = fs::current_path();
  fs::current_path(folder.path());

  publish("a.fit", "relative");
  publish("b.fit/", "slash");

  fs::current_path(before);
  EXPECT_EQ(names_in(folder.path()), (std::vector<std::string>{"a.fit", "b.fit"}));
}

TEST(OutputFolder, BehindALinkIsReplacedWhereItLies) {
  const TemporaryFolder folder;
  publish(folder / "a.fit", "old");
  fs::create_directory_symlink("a.fit", folder / "latest");

  publish(folder / "latest", "new");

  EXPECT_TRUE(fs::is_symlink(folder / "latest"));
  EXPECT_EQ(read_text(folder / "a.fit/fit.json"), "new");
}

TEST(OutputFolder, ClearsWhatDeadRunsLeftAndNothingElse) {
  const TemporaryFolder folder;
  const std::string dead = std::to_string(dead_process());
  const std::string alive = std::to_string(getppid());
  folder.write(".a.fit.partial-" + dead + "/fit.json", "half");
  folder.write(".a.fit.partial-" + alive + "/fit.json", "being written");
  folder.write(".a.fit.partial-x/fit.json", "no process");
  folder.write(".b.fit.partial-" + dead + "/fit.json", "of another result");

  publish(folder / "a.fit", "new");

  EXPECT_EQ(names_in(folder.path()),
            (std::vector<std::string>{".a.fit.partial-" + alive, ".a.fit.partial-x",
                                      ".b.fit.partial-" + dead, "a.fit"}));
}

TEST(OutputFolder, OfAKilledRunNeverShows) {
  const TemporaryFolder folder;
  publish(folder / "a.fit", "old");
  const pid_t child = fork();
  if (child == 0) {
    OutputFolder out(folder / "a.fit", {});
    write_text("half", out.path() / "fit.json");
    raise(SIGKILL);
  }
  waitpid(child, nullptr, 0);

  EXPECT_EQ(read_text(folder / "a.fit/fit.json"), "old");
  EXPECT_EQ(names_in(folder.path()).size(), 2u);
  publish(folder / "a.fit", "new");
  EXPECT_EQ(names_in(folder.path()), std::vector<std::string>{"a.fit"});
}

}  // namespace
}  // namespace clothfit
