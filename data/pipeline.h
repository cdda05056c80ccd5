#pragma once

#include <cstddef>
#include <optional>
#include <type_traits>
#include <utility>

#ifdef __SANITIZE_THREAD__
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#else
#include <tbb/parallel_pipeline.h>
#endif

namespace clothfit {

/// How the middle step of a pipeline takes items.
enum class MiddleStep { in_order, several_at_once };

#ifdef __SANITIZE_THREAD__

/// Lets threads do a step in the order of their items.
class Turn {
 public:
  /// Calls `step` once all items before have had it. Returns false and does not call it once the
  /// line is broken.
  template <class Step>
  bool take(size_t item, const Step& step) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return broken_ || next_ == item; });
    if (broken_) return false;
    step();
    ++next_;
    changed_.notify_all();
    return true;
  }
  /// Ends all waiting, and lets no step begin any more. Whoever throws must call it.
  void break_line() {
    const std::scoped_lock lock(mutex_);
    broken_ = true;
    changed_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  size_t next_ = 0;
  bool broken_ = false;
};

#endif

/// Passes items through three steps until `load` returns none, at most `in_flight` at once.
/// Loading and collecting go one item at a time, in order, while other items are in other steps.
/// Where a step throws, items under way are dropped, and what it threw is thrown once the steps
/// that run have ended. The thread sanitizer sees two threads of ours in place of oneTBB's, as in
/// for_each_index (data/parallel.h).
///
/// load() -> std::optional<Item>, work(Item) -> Item, collect(const Item&)
template <class Item, class Load, class Work, class Collect>
void run_pipeline(size_t in_flight, MiddleStep middle, const Load& load, const Work& work,
                  const Collect& collect) {
  static_assert(std::is_default_constructible_v<Item> && std::is_move_assignable_v<Item>);
#ifdef __SANITIZE_THREAD__
  std::mutex mutex;
  size_t loaded = 0;
  bool ended = false;
  std::exception_ptr first;
  Turn to_work, to_collect;
  const auto pass = [&] {
    while (true) {
      std::optional<Item> item;
      size_t number = 0;
      {
        const std::scoped_lock lock(mutex);
        if (ended) return;
        ended = true;  // also where it throws
        item = load();
        if (!item) return;
        ended = false;
        number = loaded++;
      }
      const auto do_work = [&] { item = work(std::move(*item)); };
      if (middle == MiddleStep::several_at_once)
        do_work();
      else if (!to_work.take(number, do_work))
        return;
      if (!to_collect.take(number, [&] { collect(*item); })) return;
    }
  };
  const auto pass_or_break = [&] {
    try {
      pass();
    } catch (...) {
      to_work.break_line();
      to_collect.break_line();
      const std::scoped_lock lock(mutex);
      ended = true;
      if (!first) first = std::current_exception();
    }
  };
  {
    std::jthread other;
    if (in_flight > 1) other = std::jthread(pass_or_break);
    pass_or_break();
  }
  if (first) std::rethrow_exception(first);
#else
  constexpr auto kInOrder = tbb::filter_mode::serial_in_order;
  const auto load_or_stop = [&](tbb::flow_control& control) {
    std::optional<Item> item = load();
    if (!item) control.stop();
    return item ? std::move(*item) : Item{};
  };
  tbb::parallel_pipeline(
      in_flight,
      tbb::make_filter<void, Item>(kInOrder, load_or_stop) &
          tbb::make_filter<Item, Item>(
              middle == MiddleStep::in_order ? kInOrder : tbb::filter_mode::parallel, work) &
          tbb::make_filter<Item, void>(kInOrder, collect));
#endif
}

}  // namespace clothfit
