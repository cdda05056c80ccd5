// What a pipeline promises: each item once, in order where it says so, and no more than asked for.
// Whether its steps race is for the thread sanitizer to say, on the tests of what uses it.

#include "data/pipeline.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <iterator>
#include <mutex>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <thread>
#include <vector>

namespace clothfit {
namespace {

constexpr size_t kInFlight = 3;
constexpr int kItems = 200;

/// Counts how many items are in a step at once.
class Crowd {
 public:
  void enter() {
    const int now = ++now_;
    for (int seen = most_; seen < now && !most_.compare_exchange_weak(seen, now);) {
    }
  }
  void leave() { --now_; }
  int most() const { return most_; }

 private:
  std::atomic<int> now_ = 0, most_ = 0;
};

TEST(Pipeline, PassesEachItemThroughAllStepsInOrder) {
  for (const MiddleStep middle : {MiddleStep::in_order, MiddleStep::several_at_once}) {
    SCOPED_TRACE(static_cast<int>(middle));
    int next = 0;
    std::mutex mutex;
    std::vector<int> worked, collected;
    Crowd under_way, working, collecting;

    run_pipeline<int>(
        kInFlight, middle,
        [&]() -> std::optional<int> {
          if (next == kItems) return std::nullopt;
          under_way.enter();
          return next++;
        },
        [&](int item) {
          working.enter();
          for (int n = 0; n < 50 * (item % 3); ++n) std::this_thread::yield();  // uneven work
          {
            const std::scoped_lock lock(mutex);
            worked.push_back(item);
          }
          working.leave();
          return 3 * item;
        },
        [&](int item) {
          collecting.enter();
          collected.push_back(item);
          collecting.leave();
          under_way.leave();
        });

    std::vector<int> all(kItems);
    std::iota(all.begin(), all.end(), 0);
    EXPECT_THAT(worked, testing::UnorderedElementsAreArray(all));
    if (middle == MiddleStep::in_order) {
      EXPECT_EQ(worked, all);
      EXPECT_EQ(working.most(), 1);
    }
    for (int& item : all) item *= 3;
    EXPECT_EQ(collected, all);
    EXPECT_EQ(collecting.most(), 1);
    EXPECT_LE(under_way.most(), static_cast<int>(kInFlight));
  }
}

TEST(Pipeline, ThrowsWhatAStepThrowsAndCollectsNothingBehindIt) {
  constexpr int kBad = 57;
  for (const MiddleStep middle : {MiddleStep::in_order, MiddleStep::several_at_once})
    for (const int step : {0, 1, 2}) {
      SCOPED_TRACE(testing::Message() << "step " << step << ", middle " << int(middle));
      int next = 0, loaded_behind = 0;
      std::vector<int> collected;
      const auto throw_in = [&](int here, int item) {
        if (here == step && item == kBad) throw std::range_error("bad item");
      };

      const auto run = [&] {
        run_pipeline<int>(
            kInFlight, middle,
            [&]() -> std::optional<int> {
              const int item = next++;
              if (step == 0 && item > kBad) ++loaded_behind;
              throw_in(0, item);
              return item;
            },
            [&](int item) {
              throw_in(1, item);
              return item;
            },
            [&](int item) {
              throw_in(2, item);
              collected.push_back(item);
            });
      };

      EXPECT_THROW(run(), std::range_error);
      EXPECT_EQ(loaded_behind, 0);
      EXPECT_LE(std::ssize(collected), kBad);
      EXPECT_GE(std::ssize(collected), kBad - (static_cast<int>(kInFlight) - 1));
      for (size_t n = 0; n < collected.size(); ++n) EXPECT_EQ(collected[n], static_cast<int>(n));
    }
}

TEST(Pipeline, EndsAtOnceWhereNothingIsLoaded) {
  int worked = 0;
  run_pipeline<int>(
      kInFlight, MiddleStep::several_at_once, []() -> std::optional<int> { return std::nullopt; },
      [&](int item) {
        ++worked;
        return item;
      },
      [&](int) { ++worked; });
  EXPECT_EQ(worked, 0);
}

}  // namespace
}  // namespace clothfit
