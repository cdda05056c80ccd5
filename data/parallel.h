#pragma once

#include <tbb/parallel_for.h>

#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>

#ifdef __SANITIZE_THREAD__
#include <sanitizer/tsan_interface.h>
#endif

namespace clothfit {

/// An order between threads that oneTBB brings about inside its library, where the thread sanitizer
/// does not look: what a thread did before `leave` is done for those that `enter` later. Without
/// that sanitizer it is nothing.
class ThreadEdge {
 public:
#ifdef __SANITIZE_THREAD__
  void leave() {
    __tsan_release(this);
  }
  void enter() {
    __tsan_acquire(this);
  }
#else
  void leave() {}
  void enter() {}
#endif
};

/// Runs `body` for each index below `count`, in parallel. Where a body throws, no other begins, and
/// the first exception is thrown once those that run have ended. A loop within a body always ends
/// whole: TBB itself would cut nested loops short without a word to the code behind them.
template <class Body>
void for_each_index(size_t count, const Body& body) {
  std::atomic<bool> thrown = false;
  std::exception_ptr first;
  std::mutex mutex;
  ThreadEdge begin, end;
  begin.leave();
  tbb::parallel_for(size_t{0}, count, [&](size_t n) {
    if (thrown) return;
    begin.enter();
    try {
      body(n);
    } catch (...) {
      const std::scoped_lock lock(mutex);
      if (!thrown.exchange(true)) first = std::current_exception();
    }
    end.leave();
  });
  end.enter();
  if (first) std::rethrow_exception(first);
}

}  // namespace clothfit
