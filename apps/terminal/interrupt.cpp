#include "apps/terminal/interrupt.h"

#include <time.h>

#include <atomic>
#include <csignal>

namespace clothfit {
namespace {

// A signal handler can reach nothing but globals; these are lock-free.
std::atomic<bool> interrupt_flag = false;
std::atomic<long long> first_at_ms = 0;
static_assert(std::atomic<long long>::is_always_lock_free);

/// One wish may arrive as several signals: `timeout`, for one, tells the program and its group.
constexpr long long kSameWish_ms = 500;

long long now_ms() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);  // may be called in a handler
  return now.tv_sec * 1000LL + now.tv_nsec / 1'000'000;
}

extern "C" void on_interrupt(int signal_number) {
  if (!interrupt_flag.exchange(true)) {
    first_at_ms = now_ms();
  } else if (now_ms() - first_at_ms > kSameWish_ms) {
    std::signal(signal_number, SIG_DFL);
    std::raise(signal_number);
  }
}

}  // namespace

void catch_interrupts() {
  std::signal(SIGINT, on_interrupt);
  std::signal(SIGTERM, on_interrupt);
}

bool interrupted() {
  return interrupt_flag;
}

}  // namespace clothfit
