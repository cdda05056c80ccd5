// Checks how signals end a program that does not look at them, each in a process of its own. That
// the verbs look at them: tests/apps/program_ending_test.cpp.

#include "apps/terminal/interrupt.h"

#include <gtest/gtest.h>
#include <time.h>

#include <csignal>
#include <filesystem>
#include <fstream>

#include "apps/terminal/exit_code.h"
#include "apps/terminal/result_folder.h"
#include "tests/apps/scratch_folder.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;
using ::testing::ExitedWithCode;

/// Seconds since the first call.
double elapsed_s() {
  const auto now = [] {
    timespec time{};
    clock_gettime(CLOCK_MONOTONIC, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  };
  static const double first = now();
  return now() - first;
}

/// Works and never looks at a flag. A process that this ends has missed its time.
[[noreturn]] void work_on(double seconds) {
  const double begin = elapsed_s();
  while (elapsed_s() - begin < seconds) {
  }
  _exit(99);
}

void work_for(double seconds) {
  const double begin = elapsed_s();
  while (elapsed_s() - begin < seconds) {
  }
}

TEST(Interrupt, TermEndsAProgramThatNeverLooksAndRemovesWhatIsHalfWritten) {
  const test::ScratchFolder here("term");
  EXPECT_EXIT(
      {
        catch_interrupts();
        ResultFolder out(here.path() / "result", {});
        std::ofstream(out.path() / "half") << "half";
        std::raise(SIGTERM);
        work_on(1.5);  // ends after kLongestEnding_ms
      },
      ExitedWithCode(kExitCancelled), "cancelled at once; no results were written");
  EXPECT_TRUE(fs::is_empty(here.path()));
}

TEST(Interrupt, TheSecondSignalOfAKindHalfASecondLaterEndsItAtOnce) {
  for (const int signal : {SIGINT, SIGTERM}) {
    const test::ScratchFolder here("second");
    EXPECT_EXIT(
        {
          catch_interrupts();
          ResultFolder out(here.path() / "result", {});
          std::raise(signal);
          work_for(0.6);
          std::raise(signal);
          work_on(0.25);
        },
        ExitedWithCode(kExitCancelled), "cancelled at once");
    EXPECT_TRUE(fs::is_empty(here.path()));
  }
}

TEST(Interrupt, TheSameSignalTwiceWithinHalfASecondIsOneWish) {
  EXPECT_EXIT(
      {
        catch_interrupts();
        std::raise(SIGINT);
        work_for(0.1);
        std::raise(SIGINT);
        work_for(0.2);
        _exit(interrupted() && !terminated() ? 7 : 8);
      },
      ExitedWithCode(7), "");
}

TEST(Interrupt, TheFirstCtrlCWaitsForACleanEnd) {
  EXPECT_EXIT(
      {
        catch_interrupts();
        std::raise(SIGINT);
        work_for(1.3);  // longer than SIGTERM would wait
        _exit(interrupted() ? 7 : 8);
      },
      ExitedWithCode(7), "");
}

TEST(Interrupt, AResultThatIsBeingPublishedIsLeftWhole) {
  const test::ScratchFolder here("publish");
  EXPECT_EXIT(
      {
        catch_interrupts();
        ResultFolder out(here.path() / "result", {});
        std::ofstream(out.path() / "file") << "whole";
        const auto lock = PartialFolder::keep_whole();  // as publish() has it
        std::raise(SIGTERM);
        work_on(1.5);
      },
      ExitedWithCode(kExitCancelled), "ended at once");
  EXPECT_FALSE(fs::exists(here.path() / "result"));
  // The hidden folder stays, and the next run removes it.
  { ResultFolder next(here.path() / "result", {}); }
  EXPECT_TRUE(fs::is_empty(here.path()));
}

TEST(Interrupt, PublishedResultsStay) {
  const test::ScratchFolder here("published");
  EXPECT_EXIT(
      {
        catch_interrupts();
        ResultFolder out(here.path() / "result", {});
        std::ofstream(out.path() / "file") << "whole";
        out.publish();
        std::raise(SIGTERM);
        work_on(1.5);
      },
      ExitedWithCode(kExitCancelled), "ended at once");
  EXPECT_TRUE(fs::exists(here.path() / "result" / "file"));
}

}  // namespace
}  // namespace clothfit
