// Checks the text of the progress line and when it is silent. That Ctrl-C ends a fit:
// program_end_to_end_test.cpp.
#include "apps/terminal/progress_line.h"

#include <gtest/gtest.h>

#include <cstdio>

namespace clothfit {
namespace {

TEST(ProgressText, TellsRateAndTimeLeftWhereTheTotalIsKnown) {
  const Progress progress{"refine", 240, 1000, "evaluations", "cost 0.41"};

  // 240 in 20 s is 12 per second; the other 760 take 63.3 s more.
  EXPECT_EQ(progress_text(progress, 20, 100),
            "refine  240/1000 evaluations  12/s  1:04 left  cost 0.41");
}

TEST(ProgressText, LeavesOutWhatIsNotKnownYet) {
  EXPECT_EQ(progress_text({"track", 0, 72, "frames", ""}, 0, 100), "track  0/72 frames");
  EXPECT_EQ(progress_text({"track", 30, 0, "frames", ""}, 10, 100), "track  30 frames  3/s");
  EXPECT_EQ(progress_text({"start", 0, 0, "", ""}, 5, 100), "start");
}

TEST(ProgressText, CountsHours) {
  const Progress progress{"fit", 1, 7201, "steps", ""};

  EXPECT_EQ(progress_text(progress, 1, 100), "fit  1/7201 steps  1/s  2:00:00 left");
}

TEST(ProgressText, DoesNotPromiseNegativeTimeWhenATotalWasTooSmall) {
  EXPECT_EQ(progress_text({"fit", 12, 10, "steps", ""}, 12, 100),
            "fit  12/10 steps  1/s  0:00 left");
}

TEST(ProgressText, FitsTheTerminalWithoutCuttingACharacterInTwo) {
  const Progress progress{"sérieux", 0, 0, "", ""};

  EXPECT_EQ(progress_text(progress, 0, 3), "sé");
  EXPECT_EQ(progress_text(progress, 0, 2), "s");
  EXPECT_EQ(progress_text(progress, 0, 0), "");
}

TEST(ProgressLine, IsSilentWhereTheStreamIsNotATerminal) {
  std::FILE* file = std::tmpfile();
  ASSERT_NE(file, nullptr);
  {
    ProgressLine line(file);
    line.show({"track", 1, 2, "frames", ""});
  }

  EXPECT_EQ(std::ftell(file), 0);
  std::fclose(file);
}

}  // namespace
}  // namespace clothfit
