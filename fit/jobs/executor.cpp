#include "fit/jobs/executor.h"

#include <fmt/format.h>
#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <cassert>
#include <exception>
#include <mutex>
#include <new>
#include <optional>

#include "data/input_error.h"
#include "data/parallel.h"
#include "data/shown_text.h"
#include "fit/jobs/draws.h"
#include "fit/jobs/stop_token.h"

namespace clothfit {
namespace {

/// The data that the threads of one call share.
class Run {
 public:
  Run(int count, const Work& work, const ExecuteOptions& options, Journal* journal,
      const ProgressCallback& progress)
      : work_(work), options_(options), journal_(journal), progress_(progress), failed_(count) {
    payloads_.resize(static_cast<size_t>(count));
    for (int index = 0; index < count; ++index)
      if (journal_ != nullptr && journal_->finished().contains(index))
        resume(index);
      else
        left_.push_back(index);
    tell_progress();
  }

  int left() const { return static_cast<int>(left_.size()); }

  /// Does pieces, one after another, until none is left to hand out.
  void do_pieces() {
    while (!stops_) {
      const size_t turn = next_++;
      if (turn >= left_.size()) return;
      // A piece that was handed out is done whatever stops the others: the promise about the lowest
      // index rests on it. In isolation, a thread that waits inside a piece finds only the piece's
      // own tasks.
      tbb::this_task_arena::isolate([&] { do_piece(left_[turn]); });
    }
  }

  ExecuteResult result() {
    if (failure_) std::rethrow_exception(failure_);
    ExecuteResult result;
    result.resumed = static_cast<int>(payloads_.size()) - left();
    result.performed = performed_;
    result.message =
        fmt::format("{} of {} {}", result.resumed + performed_, payloads_.size(), options_.unit);
    if (result.resumed > 0)
      result.message +=
          fmt::format(", {} of them from {}", result.resumed, journal_->file().string());
    if (performed_ == left()) {
      result.stop = ExecuteStop::finished;
      result.payloads = std::move(payloads_);
    } else {
      result.stop = ExecuteStop::cancelled;
      result.message = "cancelled after " + result.message;
    }
    return result;
  }

 private:
  std::string& payload(int index) { return payloads_[static_cast<size_t>(index)]; }

  void resume(int index) {
    if (options_.accept)
      accept_record(*journal_, index,
                    [&](const std::string& payload) { options_.accept(index, payload); });
    payload(index) = journal_->finished().at(index);
  }

  void do_piece(int index) {
    try {
      payload(index) = work_(index, derived_seed(options_.seed, index));
      const std::lock_guard lock(mutex_);
      if (journal_ != nullptr) journal_->append(index, payload(index));
      ++performed_;
      if (!stops_) tell_progress();
    } catch (const StopRequested&) {
      stops_ = true;
    } catch (...) {
      const std::lock_guard lock(mutex_);
      stops_ = true;
      if (index >= failed_) return;
      failed_ = index;
      failure_ = std::current_exception();
    }
  }

  void tell_progress() {
    if (!progress_) return;
    const size_t done = payloads_.size() - left_.size() + static_cast<size_t>(performed_);
    if (!progress_({.stage = options_.unit,
                    .done = static_cast<double>(done),
                    .total = static_cast<double>(payloads_.size()),
                    .unit = options_.unit}))
      stops_ = true;
  }

  const Work& work_;
  const ExecuteOptions& options_;
  Journal* const journal_;
  const ProgressCallback& progress_;

  std::vector<int> left_;  ///< pieces to do, ascending
  std::atomic<size_t> next_ = 0;
  std::atomic<bool> stops_ = false;

  std::mutex mutex_;                   ///< guards all below, the journal and progress
  std::vector<std::string> payloads_;  ///< each written by the one thread that does the piece
  int performed_ = 0;
  int failed_;  ///< lowest index that failed
  std::exception_ptr failure_;
};

}  // namespace

void accept_record(const Journal& journal, int index,
                   const std::function<void(const std::string& payload)>& accept) {
  try {
    accept(journal.finished().at(index));
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    throw InputError(journal.file().string(),
                     fmt::format("its record of piece {} is no result of this run ({})", index,
                                 shown_text(error.what())),
                     "a journal that this run wrote", "remove it and start from scratch");
  }
}

ExecuteResult execute(int count, const Work& work, const ExecuteOptions& options, Journal* journal,
                      const ProgressCallback& progress) {
  assert(options.threads >= 0);
  assert(count >= 0);
  using tbb::global_control;
  const int threads = options.threads > 0 ? options.threads : tbb::info::default_concurrency();
  // oneTBB gives no more threads than processors unless it is told that more are welcome.
  std::optional<global_control> more;
  if (static_cast<size_t>(threads) >
      global_control::active_value(global_control::max_allowed_parallelism))
    more.emplace(global_control::max_allowed_parallelism, threads);

  Run run(count, work, options, journal, progress);
  tbb::task_arena arena(threads);
  arena.execute([&] {
    // There are as many loops as threads, not a task for each piece. Tasks would be split into
    // ranges and not begun in order.
    for_each_index(
        static_cast<size_t>(std::min(threads, run.left())), [&](size_t) { run.do_pieces(); },
        tbb::simple_partitioner());
  });
  return run.result();
}

}  // namespace clothfit
