#include "apps/terminal/interrupt.h"

#include <semaphore.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "apps/terminal/exit_code.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;

// A signal handler can reach nothing but globals; these are lock-free.
std::atomic<long long> interrupt_ms = 0;  ///< of the first SIGINT; 0: none
std::atomic<long long> terminate_ms = 0;  ///< of the first SIGTERM; 0: none
std::atomic<bool> ends_at_once = false;
static_assert(std::atomic<long long>::is_always_lock_free);
sem_t signal_arrived;

/// One wish may arrive as several signals: `timeout`, for one, tells the program and its group.
constexpr long long kSameWish_ms = 500;

long long now_ms() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);  // may be called in a handler
  return now.tv_sec * 1000LL + now.tv_nsec / 1'000'000 + 1;
}

extern "C" void on_interrupt(int signal_number) {
  const int error_number = errno;
  std::atomic<long long>& first_ms = signal_number == SIGTERM ? terminate_ms : interrupt_ms;
  long long none = 0;
  const long long now = now_ms();
  if (!first_ms.compare_exchange_strong(none, now) && now - none > kSameWish_ms)
    ends_at_once = true;
  sem_post(&signal_arrived);
  errno = error_number;
}

/// The folders that are not published yet. They outlive every thread.
struct PartialFolders {
  std::timed_mutex mutex;
  std::vector<fs::path> folders;
};
PartialFolders& partial_folders() {
  static auto& all = *new PartialFolders;
  return all;
}

/// Removes a folder into which other threads may still write.
void remove_in_use(const fs::path& folder) {
  constexpr int kMostTries = 20;
  std::error_code error;
  for (int n = 0; n < kMostTries && fs::exists(folder, error); ++n) fs::remove_all(folder, error);
}

/// Ends the program wherever it is. Destructors do not run: a thread may be in the middle.
[[noreturn]] void end_at_once() {
  PartialFolders& partial = partial_folders();
  std::string_view said = "clothfit: warning: ended at once\n";
  // Nothing is published once the lock is had.
  if (partial.mutex.try_lock_for(milliseconds(50)) && !partial.folders.empty()) {
    for (const fs::path& folder : partial.folders) remove_in_use(folder);
    said = "clothfit: warning: cancelled at once; no results were written\n";
  }
  // Streams may be locked by a thread that stands still.
  static_cast<void>(!write(STDERR_FILENO, said.data(), said.size()));
  _exit(kExitCancelled);
}

/// Waits for signals, then for the program to end cleanly, as long as it may take.
void watch_over_ending() {
  while (true) {
    if (terminate_ms == 0) {
      sem_wait(&signal_arrived);
    } else {
      // sem_timedwait knows only the clock that people set.
      std::this_thread::sleep_for(milliseconds(10));
      if (now_ms() - terminate_ms > kLongestEnding_ms) end_at_once();
    }
    if (ends_at_once) end_at_once();
  }
}

}  // namespace

void catch_interrupts() {
  sem_init(&signal_arrived, 0, 0);
  std::thread(watch_over_ending).detach();
  std::signal(SIGINT, on_interrupt);
  std::signal(SIGTERM, on_interrupt);
}

bool interrupted() {
  return interrupt_ms != 0 || terminate_ms != 0;
}

bool terminated() {
  return terminate_ms != 0;
}

PartialFolder::PartialFolder(fs::path folder) : folder_(std::move(folder)) {
  const std::lock_guard lock(partial_folders().mutex);
  partial_folders().folders.push_back(folder_);
}

PartialFolder::~PartialFolder() {
  const std::lock_guard lock(partial_folders().mutex);
  std::erase(partial_folders().folders, folder_);
}

std::unique_lock<std::timed_mutex> PartialFolder::keep_whole() {
  return std::unique_lock(partial_folders().mutex);
}

}  // namespace clothfit
