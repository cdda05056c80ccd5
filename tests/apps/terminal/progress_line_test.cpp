// Checks the text of the progress line and what of it comes into a file. That Ctrl-C ends a fit:
// program_end_to_end_test.cpp.
#include "apps/terminal/progress_line.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <string>
#include <vector>

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

/// Returns what a line shows of these stages in a file.
std::string shown_in_a_file(std::chrono::seconds interval, const std::vector<Progress>& stages) {
  std::FILE* file = std::tmpfile();
  if (file == nullptr) return "no temporary file";
  {
    ProgressLine line(file, interval);
    for (const Progress& progress : stages) line.show(progress);
  }
  std::string text(static_cast<size_t>(std::ftell(file)), '\0');
  std::rewind(file);
  text.resize(std::fread(text.data(), 1, text.size(), file));
  std::fclose(file);
  return text;
}

TEST(ProgressLine, WritesWholeLinesWhereTheStreamIsNotATerminal) {
  const std::vector<Progress> stages = {{"track", 0, 2, "frames", ""}, {"fit", 0, 3, "steps", ""}};

  EXPECT_EQ(shown_in_a_file(std::chrono::seconds(0), stages),
            "0:00:00  track  0/2 frames\n0:00:00  fit  0/3 steps\n");
}

TEST(ProgressLine, WritesNothingToAPipeWithoutAReader) {
  // A signal would end the program.
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe(ends.data()), 0);
  close(ends[0]);
  std::FILE* stream = fdopen(ends[1], "w");
  {
    ProgressLine line(stream, std::chrono::seconds(0));
    line.show({"track", 1, 2, "frames", ""});
  }
  EXPECT_EQ(std::ferror(stream), 0);
  std::fclose(stream);
}

TEST(ProgressLine, WritesNothingToAFileBeforeTheFirstInterval) {
  EXPECT_EQ(shown_in_a_file(std::chrono::hours(1), {{"track", 1, 2, "frames", ""}}), "");
}

}  // namespace
}  // namespace clothfit
