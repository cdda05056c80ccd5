// Checks the executor: payloads, failures and cancellation for any number of threads. Not checked
// here: runs that are killed (killed_runs_test.cpp), the journal's file (journal_test.cpp).

#include "fit/jobs/executor.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <mutex>
#include <set>
#include <stdexcept>
#include <thread>

#include "data/parallel.h"
#include "fit/jobs/draws.h"
#include "tests/data/temporary_folder.h"

namespace clothfit {
namespace {

constexpr int kThreads[] = {1, 2, 3, 8};

/// Draws from one to a million numbers, as the seed has it, and returns their sum's bytes.
std::string uneven_piece(int index, std::uint64_t seed) {
  Draws draws(seed, 0, 0);
  const int count = static_cast<int>(std::pow(10, 6 * draws.uniform()));
  double sum = index;
  for (int k = 0; k < count; ++k) sum += draws.uniform();
  return {reinterpret_cast<const char*>(&sum), sizeof sum};
}

TEST(Executor, GivesTheSameBytesForAnyNumberOfThreads) {
  const std::vector<std::string> expected =
      execute(60, uneven_piece, {.threads = 1, .seed = 5}).payloads;
  ASSERT_EQ(expected.size(), 60u);
  for (int index = 0; index < 60; ++index) {
    EXPECT_EQ(expected[static_cast<size_t>(index)], uneven_piece(index, derived_seed(5, index)));
  }

  for (const int threads : kThreads) {
    SCOPED_TRACE(threads);
    const ExecuteResult result = execute(60, uneven_piece, {.threads = threads, .seed = 5});
    EXPECT_EQ(result.payloads, expected);
    EXPECT_EQ(result.performed, 60);
    EXPECT_EQ(result.message, "60 of 60 trials");
  }
  EXPECT_NE(execute(60, uneven_piece, {.seed = 6}).payloads, expected);
}

TEST(Executor, GivesEveryPieceASeedOfItsOwn) {
  std::set<std::uint64_t> seeds;
  for (std::uint64_t run = 0; run < 100; ++run)
    for (int index = 0; index < 1000; ++index) seeds.insert(derived_seed(run, index));
  EXPECT_EQ(seeds.size(), 100000u);

  // A changed value here means that no earlier run can be repeated or resumed.
  EXPECT_EQ(derived_seed(1, 0), 0x5e41ab087439611eu);
}

TEST(Executor, HasNothingToDoWithoutPieces) {
  const ExecuteResult result = execute(0, uneven_piece);
  EXPECT_TRUE(result.usable());
  EXPECT_TRUE(result.payloads.empty());
}

TEST(Executor, RethrowsTheExceptionOfTheLowestIndexForAnyNumberOfThreads) {
  // Given pieces that fail, the first of them only after much work, the others at once,
  const Work work = [](int index, std::uint64_t seed) -> std::string {
    if (index == 9) {
      double sum = 0;
      Draws draws(seed, 0, 0);
      for (int k = 0; k < 3000000; ++k) sum += draws.uniform();
      throw std::runtime_error("piece 9 after " + std::to_string(sum > 0));
    }
    if (index > 9) throw std::runtime_error("piece " + std::to_string(index));
    return uneven_piece(index, seed);
  };

  for (const int threads : kThreads) {
    SCOPED_TRACE(threads);
    const TemporaryFolder folder;
    Journal journal(folder / "journal", "key", JournalStart::fresh);
    try {
      execute(50, work, {.threads = threads}, &journal);
      ADD_FAILURE() << "nothing was thrown";
    } catch (const std::runtime_error& error) {
      EXPECT_STREQ(error.what(), "piece 9 after 1");
    }
    EXPECT_EQ(journal.finished().size(), 9u);  // all before it
  }
}

TEST(Executor, LetsNoThreadDoAnotherPiecesWorkWhileItWaitsInOne) {
  // Two pieces are at work, and idle threads help both. A thread whose last tasks an idle one took
  // must wait for them and not turn to the other piece.
  static thread_local int at_work_on = -1;
  for (const int threads : kThreads) {
    SCOPED_TRACE(threads);
    std::atomic<int> strayed = 0;
    const Work work = [&](int index, std::uint64_t) {
      if (at_work_on != -1) ++strayed;
      at_work_on = index;
      std::atomic<int> sum = 0;
      for (int round = 0; round < 100; ++round)
        for_each_index(50, [&](size_t n) {
          const int k = static_cast<int>(n);
          if (at_work_on != -1 && at_work_on != index) ++strayed;
          std::atomic<int> effort = 0;
          while (++effort < 100 * k) {
          }
          sum += k;
        });
      at_work_on = -1;
      return std::to_string(index + sum);
    };

    const ExecuteResult result = execute(2, work, {.threads = threads});

    EXPECT_EQ(strayed, 0);
    EXPECT_EQ(result.payloads[1], std::to_string(1 + 100 * 49 * 25));
  }
}

TEST(Executor, KeepsAllWorkOnTheCallingThreadWhenThereIsOne) {
  std::mutex mutex;
  std::set<std::thread::id> seen;
  const Work work = [&](int, std::uint64_t) {
    for_each_index(1000, [&](size_t) {
      const std::lock_guard lock(mutex);
      seen.insert(std::this_thread::get_id());
    });
    return std::string();
  };

  execute(5, work, {.threads = 1});

  EXPECT_THAT(seen, testing::ElementsAre(std::this_thread::get_id()));
}

TEST(Executor, MayBeUsedInsideAPiece) {
  const auto outer = [](int index, std::uint64_t seed) {
    std::string all;
    for (const std::string& inner : execute(7, uneven_piece, {.threads = 2, .seed = seed}).payloads)
      all += inner;
    return all + std::to_string(index);
  };
  EXPECT_EQ(execute(10, outer, {.threads = 3}).payloads,
            execute(10, outer, {.threads = 1}).payloads);
}

TEST(Executor, GoesOnFromAJournalWithTheSameBytesAndRedoesNothing) {
  const std::vector<std::string> expected = execute(40, uneven_piece).payloads;
  for (const int threads : kThreads) {
    for (const int stop_at : {0, 1, 17, 39}) {
      SCOPED_TRACE(testing::Message() << threads << " threads, stopped at " << stop_at);
      const TemporaryFolder folder;

      // Given a run that was cancelled,
      size_t kept = 0;
      {
        Journal journal(folder / "journal", "key", JournalStart::fresh);
        const ExecuteResult first =
            execute(40, uneven_piece, {.threads = threads}, &journal,
                    [&](const Progress& progress) { return progress.done < stop_at; });
        kept = journal.finished().size();
        if (kept < 40) {
          EXPECT_EQ(first.stop, ExecuteStop::cancelled);
          EXPECT_TRUE(first.payloads.empty());
          EXPECT_FALSE(first.usable());
          EXPECT_THAT(first.message, testing::StartsWith("cancelled after "));
        }
        // those at work are finished and kept.
        EXPECT_GE(kept, static_cast<size_t>(stop_at));
        EXPECT_LE(kept, static_cast<size_t>(stop_at + threads));
        EXPECT_EQ(first.performed, static_cast<int>(kept));
      }

      Journal journal(folder / "journal", "key", JournalStart::resume);
      const std::map<int, std::string> found = journal.finished();
      std::mutex mutex;
      std::set<int> done;
      const Work noting = [&](int index, std::uint64_t seed) {
        {
          const std::lock_guard lock(mutex);
          EXPECT_TRUE(done.insert(index).second);
        }
        return uneven_piece(index, seed);
      };
      const ExecuteResult rest = execute(40, noting, {.threads = threads}, &journal);

      EXPECT_EQ(found.size(), kept);
      EXPECT_EQ(rest.payloads, expected);
      EXPECT_EQ(rest.resumed, static_cast<int>(kept));
      EXPECT_EQ(done.size(), 40 - kept);
      for (const int index : done) EXPECT_FALSE(found.contains(index));
    }
  }
}

TEST(Executor, ProlongsARun) {
  const TemporaryFolder folder;
  {
    Journal journal(folder / "journal", "key", JournalStart::fresh);
    execute(10, uneven_piece, {}, &journal);
  }
  Journal journal(folder / "journal", "key", JournalStart::resume);

  const ExecuteResult longer = execute(25, uneven_piece, {}, &journal);
  const ExecuteResult shorter = execute(5, uneven_piece, {}, &journal);

  EXPECT_EQ(longer.resumed, 10);
  EXPECT_EQ(longer.payloads, execute(25, uneven_piece).payloads);
  EXPECT_EQ(shorter.performed, 0);
  EXPECT_EQ(shorter.payloads, execute(5, uneven_piece).payloads);
}

TEST(Executor, TellsProgressOneStepAtATime) {
  for (const int threads : kThreads) {
    std::vector<double> told;
    execute(12, uneven_piece, {.threads = threads, .unit = "pairs"}, nullptr,
            [&](const Progress& progress) {
              EXPECT_EQ(progress.total, 12);
              EXPECT_EQ(progress.unit, "pairs");
              told.push_back(progress.done);
              return true;
            });
    EXPECT_THAT(told, testing::ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12));
  }
}

TEST(Executor, IsFinishedWhenItIsCancelledAfterTheLastPiece) {
  const ExecuteResult result =
      execute(6, uneven_piece, {}, nullptr, [](const Progress& now) { return now.done < 6; });
  EXPECT_TRUE(result.usable());
  EXPECT_EQ(result.payloads.size(), 6u);
}

TEST(Executor, RethrowsWhatProgressThrows) {
  for (const int threads : kThreads) {
    EXPECT_THROW(execute(20, uneven_piece, {.threads = threads}, nullptr,
                         [](const Progress& now) -> bool {
                           if (now.done == 4) throw std::logic_error("progress");
                           return true;
                         }),
                 std::logic_error);
  }
}

}  // namespace
}  // namespace clothfit
