#include "data/shared_progress.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>
#include <vector>

namespace clothfit {
namespace {

TEST(SharedProgress, AsksOneThreadAtATimeAndNoneAfterARefusal) {
  int calls = 0;  // Not atomic: the callback is for threads that wait for each other
  const ProgressCallback shared = for_threads([&](const Progress&) { return ++calls < 100; });
  std::atomic<int> refusals = 0;
  {
    std::vector<std::jthread> threads;
    for (int n = 0; n < 4; ++n)
      threads.emplace_back([&] {
        for (int k = 0; k < 50; ++k)
          if (!shared({})) ++refusals;
      });
  }

  EXPECT_EQ(calls, 100);
  EXPECT_EQ(refusals, 4 * 50 - 99);
}

TEST(SharedProgress, IsNothingWhereThereIsNone) {
  EXPECT_FALSE(for_threads({}));
}

}  // namespace
}  // namespace clothfit
