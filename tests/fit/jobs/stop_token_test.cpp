// Checks how a call ends that nobody waits for. That fits and diagnoses catch it: fit_test.cpp,
// diagnose_test.cpp.
#include "fit/jobs/stop_token.h"

#include <gtest/gtest.h>

#include <atomic>
#include <vector>

#include "data/parallel.h"

namespace clothfit {
namespace {

TEST(StopToken, ThrowsOnceTheCallbackSaysStopAndAsksItNoMore) {
  int asked = 0;
  const ProgressCallback token = stop_token([&](const Progress&) { return ++asked < 3; });
  EXPECT_TRUE(token({}));
  EXPECT_TRUE(token({}));
  EXPECT_THROW(token({}), StopRequested);
  EXPECT_THROW(token({}), StopRequested);
  EXPECT_EQ(asked, 3);
}

TEST(StopToken, EndsAParallelLoopFromAnyThread) {
  std::atomic<int> asked = 0;
  const ProgressCallback token = stop_token([&](const Progress&) { return ++asked < 5; });
  EXPECT_THROW(for_each_index(1000, [&](size_t) { token({}); }), StopRequested);
  EXPECT_EQ(asked, 5);
}

TEST(ForEachIndex, EndsLoopsWithinItWholeWhereOneBodyThrows) {
  constexpr size_t kOuter = 16, kInner = 1000;
  for (int repeat = 0; repeat < 20; ++repeat) {
    std::atomic<size_t> begun = 0, done = 0;
    EXPECT_THROW(for_each_index(kOuter,
                                [&](size_t n) {
                                  if (n == kOuter / 2) throw StopRequested();
                                  ++begun;
                                  for_each_index(kInner, [&](size_t) { ++done; });
                                }),
                 StopRequested);
    EXPECT_EQ(done, kInner * begun);
  }
}

TEST(ForEachIndex, RunsEachIndexOnce) {
  std::vector<int> runs(1000, 0);
  for_each_index(runs.size(), [&](size_t n) { ++runs[n]; });
  EXPECT_EQ(runs, std::vector<int>(1000, 1));
}

TEST(StopToken, IsNoneWhereNothingIsReported) {
  EXPECT_FALSE(stop_token({}));
  report_progress({}, {});
  EXPECT_THROW(report_progress([](const Progress&) { return false; }, {}), StopRequested);
}

}  // namespace
}  // namespace clothfit
