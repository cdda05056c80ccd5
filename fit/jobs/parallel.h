#pragma once

#include <tbb/parallel_for.h>

#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>

namespace clothfit {

/// Runs `body` for each index below `count`, in parallel. Where a body throws, no other begins, and
/// the first exception is thrown once those that run have ended. A loop within a body always ends
/// whole: TBB itself would cut nested loops short without a word to the code behind them.
template <class Body>
void for_each_index(size_t count, const Body& body) {
  std::atomic<bool> thrown = false;
  std::exception_ptr first;
  std::mutex mutex;
  tbb::parallel_for(size_t{0}, count, [&](size_t n) {
    if (thrown) return;
    try {
      body(n);
    } catch (...) {
      const std::scoped_lock lock(mutex);
      if (!thrown.exchange(true)) first = std::current_exception();
    }
  });
  if (first) std::rethrow_exception(first);
}

}  // namespace clothfit
