// Checks from outside that the program ends soon after a signal inside long simulations, that a
// study that was killed ends as one that was not, and what is refused as too long or too large
// before it begins. Signals alone: terminal/interrupt_test.cpp; long fits that end at a generation:
// program_end_to_end_test.cpp.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <regex>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "tests/apps/bundled_recordings.h"
#include "tests/apps/program_run.h"
#include "tests/apps/scratch_folder.h"
#include "tests/data/whole_runs.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;
using test::names_in;
using test::ProgramRun;
using test::run_program;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Clock = std::chrono::steady_clock;

/// A cloth of 17 x 17 vertices; `more` adds lines or replaces none.
void write_model(const fs::path& file, const std::string& time, const std::string& fabric_tension,
                 const std::string& start = "released_flat", const std::string& more = "",
                 int mesh = 17) {
  std::ofstream(file) << "format: clothfit-model/1\nname: sheet\ncloth: {size: [0.4, 0.4], mass: "
                         "0.03, mesh: {columns: "
                      << mesh << ", rows: " << mesh
                      << "}}\nfabric: {tension_warp: " << fabric_tension
                      << ", tension_weft: 50, shear: 20, flexion_warp: 10, flexion_weft: 10, "
                         "damping_warp: 0.002, damping_weft: 0.002}\n"
                         "held: [{at: [0, 0], motion: fixed}, {at: [0.4, 0], motion: fixed}]\n"
                         "start: {kind: "
                      << start
                      << ", position: [0, 0, 1], orientation: [1, 0, 0, 0]}\ntime: " << time << "\n"
                      << more;
}

bool has_ended(int process) {
  siginfo_t info{};
  return waitid(P_PID, static_cast<id_t>(process), &info, WEXITED | WNOHANG | WNOWAIT) != 0 ||
         info.si_pid != 0;
}

/// Waits until a running program shows something or ends. Says no where it did neither.
bool wait_until(int process, const std::function<bool()>& shown) {
  const auto give_up = Clock::now() + std::chrono::minutes(2);
  while (!shown() && !has_ended(process)) {
    if (Clock::now() > give_up) return false;
    std::this_thread::yield();
  }
  return true;
}

/// Returns the seconds of a processor that a running program's first thread has had.
double processor_s(int process) {
  std::ifstream in("/proc/" + std::to_string(process) + "/task/" + std::to_string(process) +
                   "/stat");
  std::string text;
  std::getline(in, text);
  std::istringstream fields(text.substr(std::min(text.rfind(')') + 1, text.size())));
  std::string passed_over;
  for (int field = 3; field < 14; ++field) fields >> passed_over;
  double user = 0, system = 0;
  fields >> user >> system;
  return (user + system) / static_cast<double>(sysconf(_SC_CLK_TCK));
}

/// Runs the program, sends it a signal once it is at work, and says how long it took to end. A
/// hidden folder shows that it is, and then the time that it has had.
struct Ended {
  ProgramRun run;
  double seconds = 0;
};

Ended end_by(int signal, const std::vector<std::string>& arguments, const fs::path& folder) {
  const size_t before = names_in(folder).size();
  Clock::time_point sent;
  Ended ended;
  ended.run = run_program(arguments, folder, [&](int process) {
    wait_until(process, [&] { return names_in(folder).size() != before; });
    // It is inside its first simulation soon; what comes before ends as soon.
    const double begun_s = processor_s(process);
    wait_until(process, [&] { return processor_s(process) > begun_s + 0.2; });
    sent = Clock::now();
    kill(process, signal);
  });
  ended.seconds = std::chrono::duration<double>(Clock::now() - sent).count();
  return ended;
}

/// A second is promised; a busy machine gives the process its time late.
constexpr double kSoon_s = 3;

TEST(ProgramEnding, OfOneLongSimulationIsPromptAndLeavesNothing) {
  for (const char* start : {"released_flat", "at_rest"})
    for (const int signal : {SIGTERM, SIGINT}) {
      SCOPED_TRACE(std::string(start) + " " + std::to_string(signal));
      const test::ScratchFolder here("ending_simulate");
      // One frame interval of minutes.
      write_model(here.path() / "sheet.yaml", "{frame_rate: 0.01, duration: 100}", "3000", start);

      const Ended ended = end_by(signal, {"simulate", "sheet.yaml"}, here.path());

      EXPECT_EQ(ended.run.exit_code, 130) << ended.run.error;
      EXPECT_LT(ended.seconds, kSoon_s);
      EXPECT_THAT(names_in(here.path()), ElementsAre("sheet.yaml"));
    }
}

TEST(ProgramEnding, OfAFitOnAFineMeshIsPromptAndLeavesNothing) {
  for (const int signal : {SIGTERM, SIGINT}) {
    const test::ScratchFolder here("ending_fit");
    const Ended ended = end_by(signal,
                               {"fit", (kBundled / "swing_plain").string(), "--mesh", "49x49",
                                "--population", "4", "--generations", "1"},
                               here.path());

    EXPECT_EQ(ended.run.exit_code, 130) << ended.run.error;
    EXPECT_LT(ended.seconds, kSoon_s);
    EXPECT_TRUE(names_in(here.path()).empty());
  }
}

TEST(ProgramEnding, OfAStudyByTermKeepsItsJournalAlone) {
  const test::ScratchFolder here("ending_recover");
  const Ended ended = end_by(SIGTERM,
                             {"recover", "--trials", "2", "--mesh", "33", "--truth-mesh", "33",
                              "--truth-steps", "500", "--seconds", "1", "--out", "r"},
                             here.path());

  EXPECT_EQ(ended.run.exit_code, 130) << ended.run.error;
  EXPECT_LT(ended.seconds, kSoon_s);
  EXPECT_THAT(names_in(here.path()), ElementsAre("r.journal"));
}

// --- killed runs ------------------------------------------------------------------------------

std::string bytes_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Returns the files of a result by name, without columns and numbers that a clock measured.
std::map<std::string, std::string> result_of(const fs::path& folder) {
  const std::regex pages(R"(class="(number )?measured">[^<]*|data-name="([a-z]+ )?s" [^>]*>[^<]*)");
  const std::regex one_cell(R"(,[^,\n]*\n)"), two_cells(R"(,[^,\n]*,[^,\n]*\n)");
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string bytes = bytes_of(entry.path());
    const std::string head = bytes.substr(0, bytes.find('\n'));
    // Columns of seconds are the last.
    const std::regex& timed = head.ends_with("seconds,drawing_seconds") ? two_cells
                              : head.ends_with("seconds")               ? one_cell
                                                                        : pages;
    files[entry.path().filename()] = std::regex_replace(bytes, timed, "");
  }
  return files;
}

/// Kills a study each time that its journal has grown, until it ends. Returns the kills.
int kill_at_each_record(std::vector<std::string> arguments, const fs::path& folder) {
  arguments.emplace_back("--resume");
  const fs::path journal = folder / "out.journal";
  for (int kills = 0;; ++kills) {
    const auto records = [&] {
      const std::string bytes = bytes_of(journal);
      int count = 0;
      for (size_t at = bytes.find("\nrecord "); at != std::string::npos;
           at = bytes.find("\nrecord ", at + 1))
        ++count;
      return count;
    };
    const int before = records();
    bool in_time = false;
    const ProgramRun run = run_program(arguments, folder, [&](int process) {
      in_time = wait_until(process, [&] { return records() > before; });
      kill(process, SIGKILL);
    });
    EXPECT_TRUE(in_time) << "no record came";
    if (run.exit_code == 0) return kills;
    EXPECT_EQ(run.exit_code, 128 + SIGKILL) << run.error;
    if (run.exit_code != 128 + SIGKILL || !in_time) return kills;
  }
}

void expect_kills_to_leave_no_trace(const std::vector<std::string>& arguments) {
  const test::ScratchFolder here("killed_study");
  const auto once = here.path() / "once", killed = here.path() / "killed";
  fs::create_directory(once);
  fs::create_directory(killed);
  ASSERT_EQ(run_program(arguments, once).exit_code, 0);

  EXPECT_GE(kill_at_each_record(arguments, killed), 1);

  EXPECT_EQ(result_of(killed / "out"), result_of(once / "out"));
  EXPECT_EQ(names_in(killed), names_in(once));  // neither journals nor partial folders
}

TEST(KilledStudy, EndsWithTheBytesOfAnUndisturbedOne) {
  expect_kills_to_leave_no_trace({"recover", "--trials", "6", "--start-factor", "2", "--mesh", "9",
                                  "--truth-mesh", "9", "--markers", "9", "--seconds", "0.5",
                                  "--threads", "1", "--out", "out"});
}

TEST(KilledStudy, OfDiagnosesEndsWithTheBytesOfAnUndisturbedOne) {
  CLOTHFIT_ONLY_IN_WHOLE_RUNS();
  expect_kills_to_leave_no_trace(
      {"recover", "--undeclared", "--clean", "--trials",      "3", "--rate",
       "30",      "--seconds",    "0.4",     "--mesh",        "4", "--truth-mesh",
       "4",       "--markers",    "4",       "--truth-steps", "1", "--lines",
       "1",       "--refits",     "1",       "--threads",     "1", "--out",
       "out"});
}

// --- limits -----------------------------------------------------------------------------------

/// Runs what must be refused at once; returns what it says.
std::string refusal(const std::vector<std::string>& arguments, const fs::path& folder) {
  const std::vector<std::string> before = names_in(folder);
  const auto begin = Clock::now();
  const ProgramRun run = run_program(arguments, folder);
  EXPECT_LT(std::chrono::duration<double>(Clock::now() - begin).count(), 15) << run.error;
  EXPECT_EQ(run.exit_code, 3) << run.error;
  EXPECT_EQ(names_in(folder), before);
  return run.error;
}

TEST(ProgramLimits, RefuseSimulationsBeyondADayWithTheEstimateAndTheRemedy) {
  const test::ScratchFolder here("limits_simulate");
  const auto said = [&](const std::string& time, const std::string& tension,
                        const std::string& more = "", std::vector<std::string> options = {},
                        int mesh = 17) {
    write_model(here.path() / "sheet.yaml", time, tension, "released_flat", more, mesh);
    std::vector<std::string> arguments{"simulate", "sheet.yaml"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return refusal(arguments, here.path());
  };
  EXPECT_THAT(said("{frame_rate: 60, duration: 0.1}", "1e9"),
              AllOf(HasSubstr("sheet.yaml"), HasSubstr("time steps"), HasSubstr("at most 1e+08")));
  EXPECT_THAT(said("{frame_rate: 60, duration: 0.1}", "50", "time_step: 1e-9\n"),
              AllOf(HasSubstr("sheet.yaml:"), HasSubstr("times as fine")));
  EXPECT_THAT(said("{frame_rate: 60, duration: 0.1}", "50", "", {"--time-step", "1e-300"}),
              AllOf(HasSubstr("--time-step"), HasSubstr("times as fine")));
  EXPECT_THAT(said("{frame_rate: 0.001, duration: 9e8}", "50"), HasSubstr("time steps"));
  EXPECT_THAT(said("{frame_rate: 1e6, duration: 0.005}", "50", "", {}, 256),
              AllOf(HasSubstr("sheet.yaml"), HasSubstr("GB of memory"), HasSubstr("at most 4 GB")));
  EXPECT_THAT(said("{frame_rate: 1e6, duration: 0.2}", "50", "", {"--format", "obj"}, 3),
              AllOf(HasSubstr("--format"), HasSubstr("at most 100000")));
}

TEST(ProgramLimits, RefuseFitsBeyondADayWithTheEstimateAndTheRemedy) {
  const test::ScratchFolder here("limits_fit");
  const std::string recording = (kBundled / "swing_plain").string();
  EXPECT_THAT(
      refusal({"fit", recording, "--mesh", "256x256", "--substep-scale", "1000"}, here.path()),
      AllOf(HasSubstr("recording.yaml"), HasSubstr("at most"), HasSubstr("--mesh")));
  EXPECT_THAT(refusal({"fit", recording, "--substep-scale", "1e308"}, here.path()),
              AllOf(HasSubstr("--substep-scale"), HasSubstr("1 to 1000")));
  EXPECT_THAT(refusal({"fit", recording, "--generations", "2147483647"}, here.path()),
              HasSubstr("--generations"));
}

TEST(ProgramLimits, RefuseScenesBeyondMemoryAndADay) {
  const test::ScratchFolder here("limits_recover");
  for (const auto& [option, value] :
       std::vector<std::pair<std::string, std::string>>{{"--markers", "100000"},
                                                        {"--markers", "2147483647"},
                                                        {"--truth-mesh", "2147483647"},
                                                        {"--truth-steps", "2147483647"},
                                                        {"--seconds", "1e300"},
                                                        {"--rate", "1e300"},
                                                        {"--before", "1e300"},
                                                        {"--trials", "2147483647"},
                                                        {"--threads", "2147483647"},
                                                        {"--start-nodes", "2147483647"},
                                                        {"--mesh", "2147483647"}}) {
    SCOPED_TRACE(option + " " + value);
    EXPECT_THAT(refusal({"recover", "--out", "r", option, value}, here.path()),
                HasSubstr(option == "--rate" ? "--" : option));
  }
  EXPECT_THAT(
      refusal({"recover", "--trials", "1", "--markers", "256", "--seconds", "1000", "--out", "r"},
              here.path()),
      AllOf(HasSubstr("--markers"), HasSubstr("GB of memory")));
  EXPECT_THAT(refusal({"recover", "--trials", "1", "--truth-mesh", "256", "--markers", "5",
                       "--truth-steps", "1000", "--out", "r"},
                      here.path()),
              AllOf(HasSubstr("--truth-steps"), HasSubstr("spring-steps")));
}

TEST(ProgramLimits, RefuseMoreHeldPointsThanCanBePlaced) {
  const test::ScratchFolder here("limits_held");
  write_model(here.path() / "sheet.yaml", "{frame_rate: 60, duration: 0.1}", "50");
  std::string text = bytes_of(here.path() / "sheet.yaml");
  std::string held = "held: [{edge: top, motion: fixed}";
  for (int n = 0; n < 1100; ++n)
    held += ", {at: [" + std::to_string(0.0003 * n) + ", 0.1], motion: fixed}";
  text.replace(text.find("held:"), text.find("start:") - text.find("held:"), held + "]\n");
  std::ofstream(here.path() / "sheet.yaml") << text;

  EXPECT_THAT(refusal({"simulate", "sheet.yaml"}, here.path()),
              AllOf(HasSubstr("sheet.yaml"), HasSubstr("at most 1024")));
}

}  // namespace
}  // namespace clothfit
