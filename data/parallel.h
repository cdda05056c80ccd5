#pragma once

#include <tbb/parallel_for.h>

#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>

#ifdef __SANITIZE_THREAD__
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <thread>
#endif

namespace clothfit {

/// Calls `task` for each index below `count`, in parallel. The thread sanitizer takes what oneTBB
/// hands from thread to thread inside its library for races. It sees two threads of ours instead,
/// which suffice to show one. `task` must not throw.
template <class Task, class Partitioner>
void run_tasks(size_t count, const Task& task, [[maybe_unused]] const Partitioner& partitioner) {
#ifdef __SANITIZE_THREAD__
  using tbb::global_control;
  const bool alone = count < 2 || tbb::this_task_arena::max_concurrency() < 2 ||
                     global_control::active_value(global_control::max_allowed_parallelism) < 2;
  const size_t step = alone ? 1 : 2;  // a shared counter would order what oneTBB does not
  const auto work = [&](size_t first) {
    for (size_t n = first; n < count; n += step) task(n);
  };
  std::jthread other;
  if (!alone) other = std::jthread(work, size_t{1});
  work(0);
#else
  tbb::parallel_for(size_t{0}, count, task, partitioner);
#endif
}

/// Runs `body` for each index below `count`, in parallel. Where a body throws, no other begins, and
/// the first exception is thrown once those that run have ended. A loop within a body always ends
/// whole: TBB itself would cut nested loops short without a word to the code behind them.
template <class Body, class Partitioner = tbb::auto_partitioner>
void for_each_index(size_t count, const Body& body, const Partitioner& partitioner = {}) {
  std::atomic<bool> thrown = false;
  std::exception_ptr first;
  std::mutex mutex;
  run_tasks(
      count,
      [&](size_t n) {
        if (thrown) return;
        try {
          body(n);
        } catch (...) {
          const std::scoped_lock lock(mutex);
          if (!thrown.exchange(true)) first = std::current_exception();
        }
      },
      partitioner);
  if (first) std::rethrow_exception(first);
}

}  // namespace clothfit
